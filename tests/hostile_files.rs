//! Files that lie: no reader panics, and none takes more memory than the length of its file pays
//! for.
//!
//! Every format has a corpus of valid files, which are damaged at random (`common/fuzz.rs`), and
//! lies made by hand. The long run is `GLASSWARP_FUZZ_CASES=1000000 cargo test --release --test
//! hostile_files -- --nocapture`; docs/reliability.md has its figures.

#[path = "common/corpus.rs"]
mod corpus;
#[path = "common/fuzz.rs"]
mod fuzz;

use corpus::files_of;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    LineOrder, Vec2, WritableImage,
};
use fuzz::{Read, Target, cases};
use glam::DVec2;
use glasswarp::{
    bench::ExitFace,
    export::{self, Design, HeightMap},
    grid::{Extent, Field, Outline},
    irradiance::{Picture, PictureError, PictureOptions},
    solid::{Solid, Stock},
    surface::HeightField,
};
use glasswarp_verify::{
    Block, BlockError, Mesh, PhotonPlan, PhotonTally, PlacedBlock, Scene, Surface, Tracer, Window, beams,
    cut::{Plan, Sheet, Strokes},
    load::{self, Format},
    photons,
    program::{Dynamics, Move, ProgramFault, Run, SurveyLimits, Tool, run, survey},
    reference::{ReadOptions, Reference},
};
use std::{
    fs,
    io::{Cursor, Read as _, Write as _},
};

/// A block of so few nodes that a file of it is quickly read.
fn solid(outline: Outline) -> Solid {
    let heights = (0..99).map(|k| 0.1 * f64::from(k % 11) + 0.05 * f64::from(7 * k % 31).sin()).collect();
    let surface = HeightField::outlined(Extent::new(20.0, 16.0), outline, Field::from_vec(11, 9, heights));
    Solid::new(&surface, Stock::thinnest_sheet()).unwrap()
}

/// The block as a file of this kind.
fn exported(extension: &str) -> Vec<u8> {
    exported_of(extension, &solid(Outline::Rectangle))
}

fn exported_of(extension: &str, solid: &Solid) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("block.{extension}"));
    let design = Design { name: "block".into(), exit_face: ExitFace::Refracts { ior: 1.5 }, distance_mm: 250.0 };
    match extension {
        "png" | "exr" => HeightMap::of(solid).write(&path).unwrap(),
        _ => export::export(&path, solid, &design).unwrap(),
    }
    fs::read(path).unwrap()
}

const TETRAHEDRON_STL: &str = "solid t\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n\
    facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1e0\nendloop\nendfacet\nendsolid t\n";
const TETRAHEDRON_OBJ: &str = "mtllib a.mtl\no t\ng u\nusemtl m\ns 1\nv 0 0 0\nv 1 0 0 1\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvt 0 0\n\
    f 1 3 2\nf 1//1 2//1 4//1\nf 1/1 4/1 3/1\nf -3/1/1 -2/1/1 -1/1/1\nl 1 2\np 1\n";
const QUAD_PLY: &str = "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n\
    property uchar red\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 1 4\n\
    4 0 1 2 3\n3 0 1 2\n";

/// A solid may take this: a fixed part for tables, and so much for every byte.
fn mesh_memory(length: usize) -> usize {
    (16 << 20) + 400 * length
}

/// What a solid of this kind becomes, on through recognition to a few beams.
fn read_solid(format: Format) -> impl Fn(&[u8]) -> Read {
    move |bytes| {
        let mesh = load::parse(format, bytes);
        let read = Read::of(mesh.as_ref().map(|_| ()));
        if let Ok(mesh) = mesh {
            recognise(mesh);
        }
        read
    }
}

/// Finds out what a mesh is, and looks through it.
fn recognise(mesh: Mesh) {
    let window = Window { size_mm: DVec2::new(20.0, 16.0), centre_mm: DVec2::ZERO, nx: 8, ny: 8 };
    let scene = Scene::new(1.5, 250.0, window);
    let tracer = match PlacedBlock::find(mesh, None) {
        Ok(placed) => Tracer::for_block(&placed.block, &scene),
        Err(other) if matches!(other.1, BlockError::Unsound(_)) => return,
        Err(other) => Tracer::for_solid(&other.0, &Scene { surface: Surface::Facets, ..scene }),
    };
    if let Ok(tracer) = tracer {
        assert!(beams(&tracer, 8, 8).image.values.iter().all(|value| value.is_finite() && *value >= 0.0));
    }
}

#[test]
fn stl() {
    let corpus = vec![exported("stl"), TETRAHEDRON_STL.into()];
    Target { name: "STL", corpus, mend: None, memory: mesh_memory }.run(cases(5000), read_solid(Format::Stl));
}

#[test]
fn obj() {
    let corpus = vec![exported("obj"), TETRAHEDRON_OBJ.into()];
    Target { name: "OBJ", corpus, mend: None, memory: mesh_memory }.run(cases(5000), read_solid(Format::Obj));
}

#[test]
fn off() {
    let corpus = vec![block_off().into(), TETRAHEDRON_OFF.into()];
    Target { name: "OFF", corpus, mend: None, memory: mesh_memory }.run(cases(5000), read_solid(Format::Off));
}

const TETRAHEDRON_OFF: &str =
    "NOFF # n\n4 4 6\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n0 0 1 0 0 1\n3 0 2 1\n3 0 1 3 255 0 0\n3 0 3 2\n3 1 2 3\n";

/// The block as OFF.
fn block_off() -> String {
    let mesh = load::parse(Format::Stl, &exported("stl")).unwrap();
    let vertices = mesh.vertices.iter().map(|v| format!("{} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n"));
    let counts = format!("OFF\n{} {} 0\n", mesh.vertices.len(), mesh.triangles.len());
    counts + &vertices.chain(faces).collect::<String>()
}

#[test]
fn glb() {
    let corpus = vec![exported("glb")];
    let mend: Option<fn(&mut Vec<u8>)> = Some(|file| mend_glb(file));
    Target { name: "GLB", corpus, mend, memory: mesh_memory }.run(cases(5000), read_solid(Format::Gltf));
}

#[test]
fn ply() {
    let corpus = vec![exported("ply"), QUAD_PLY.into()];
    Target { name: "PLY", corpus, mend: None, memory: mesh_memory }.run(cases(5000), read_solid(Format::Ply));
}

#[test]
fn step() {
    let trimmed = [Outline::Circle, Outline::Rounded { radius_mm: 3.0 }].map(|of| exported_of("step", &solid(of)));
    let corpus = [vec![exported("step")], trimmed.to_vec()].concat();
    Target { name: "STEP", corpus, mend: None, memory: mesh_memory }.run(cases(2000), read_solid(Format::Step));
}

#[test]
fn three_mf() {
    // What is damaged is the model; the package is put around it afterwards.
    let whole = exported("3mf");
    let mut archive = zip::ZipArchive::new(Cursor::new(&whole)).unwrap();
    let name = archive.file_names().map(Result::unwrap).find(|name| name.ends_with(".model")).unwrap().into_owned();
    let mut model = Vec::new();
    archive.by_name(&name).unwrap().read_to_end(&mut model).unwrap();
    let read = read_solid(Format::ThreeMf);
    Target { name: "3MF, its model", corpus: vec![model], mend: None, memory: mesh_memory }
        .run(cases(2000), |model| read(&package(model)));
    Target { name: "3MF, its package", corpus: vec![whole, package(TETRAHEDRON_3MF)], mend: None, memory: mesh_memory }
        .run(cases(5000), read_solid(Format::ThreeMf));
}

const TETRAHEDRON_3MF: &[u8] =
    b"<?xml version=\"1.0\"?><model unit=\"inch\"><resources><object id=\"1\"><mesh><vertices>\
    <vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"1\" z=\"0\"/></vertices>\
    <triangles><triangle v1=\"0\" v2=\"2\" v3=\"1\"/></triangles></mesh></object></resources><build/></model>";

fn package(model: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let relations = "<Relationships><Relationship Target=\"/3D/m.model\" Type=\"x/3dmodel\"/></Relationships>";
    for (name, bytes) in [("_rels/.rels", relations.as_bytes()), ("3D/m.model", model)] {
        zip.start_file(name, options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

#[test]
fn height_maps() {
    let png = Target {
        name: "height map, PNG",
        corpus: vec![exported("png")],
        mend: Some(mend_png),
        // A byte of PNG holds up to 516 heights.
        memory: |length| (16 << 20) + 516 * 64 * length,
    };
    png.run(cases(5000), read_solid(Format::HeightMapPng));
    let exr = Target { name: "height map, OpenEXR", corpus: vec![exported("exr")], mend: None, memory: exr_memory };
    exr.run(cases(3000), read_solid(Format::HeightMapExr));
}

/// OpenEXR packs no further than deflate.
fn exr_memory(length: usize) -> usize {
    (32 << 20) + 1032 * 16 * length
}

/// What a picture may take here; the program allows what the machine has.
const PICTURE_MEMORY: u64 = 32 << 20;

fn read_within(bytes: &[u8]) -> Result<Picture, PictureError> {
    let options = PictureOptions::default().with_memory(PICTURE_MEMORY).with_drawing_width(64);
    options.read(Cursor::new(bytes)).map(|(picture, _)| picture)
}

fn read_picture(bytes: &[u8]) -> Read {
    Read::of(read_within(bytes))
}

/// Decoders hold rows, blocks and tables besides the picture.
fn picture_memory(length: usize) -> usize {
    2 * PICTURE_MEMORY as usize + 64 * length
}

fn corpus_of(extensions: &[&str]) -> Vec<Vec<u8>> {
    files_of("tests/corpus", extensions)
}

/// The pictures of tests/pictures that are read: with profiles, orientation, layers.
fn kinds_of(extensions: &[&str]) -> Vec<Vec<u8>> {
    let mut files = files_of("tests/pictures", extensions);
    files.retain(|file| matches!(read_picture(file), Read::Taken));
    assert!(!files.is_empty());
    files
}

fn pictures(name: &str, extensions: &[&str], mend: Option<fn(&mut Vec<u8>)>) {
    let corpus = [corpus_of(extensions), kinds_of(extensions)].concat();
    Target { name, corpus, mend, memory: picture_memory }.run(cases(4000), read_picture);
}

/// The decoder believes the number of values of a tag, up to a limit of its own.
fn tiff_memory(length: usize) -> usize {
    (384 << 20) + picture_memory(length)
}

#[test]
fn pictures_png() {
    pictures("picture, PNG", &["png"], Some(mend_png));
}

#[test]
fn pictures_jpeg() {
    pictures("picture, JPEG", &["jpg"], None);
}

#[test]
fn pictures_tiff() {
    let corpus = [corpus_of(&["tif"]), kinds_of(&["tif"])].concat();
    Target { name: "picture, TIFF", corpus, mend: None, memory: tiff_memory }.run(cases(4000), read_picture);
}

#[test]
fn pictures_webp() {
    pictures("picture, WebP", &["webp"], None);
}

#[test]
fn pictures_gif() {
    pictures("picture, GIF", &["gif"], None);
}

#[test]
fn pictures_bmp() {
    pictures("picture, BMP", &["bmp"], None);
}

#[test]
fn pictures_pnm() {
    pictures("picture, PNM", &["ppm", "pgm", "pam", "pbm"], None);
}

#[test]
fn pictures_svg() {
    let corpus = kinds_of(&["svg"]);
    let target = Target { name: "picture, SVG", corpus, mend: None, memory: picture_memory };
    target.run(cases(1500), read_picture);
}

#[test]
fn pictures_exr() {
    let written: Vec<_> = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::DWAA(None),
        Compression::DWAB(None),
    ]
    .into_iter()
    .flat_map(|compression| {
        [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 4))].map(|blocks| exr_picture(compression, blocks))
    })
    .collect();
    let corpus = [written, kinds_of(&["exr"])].concat();
    let target = Target { name: "picture, OpenEXR", corpus, mend: None, memory: picture_memory };
    target.run(cases(3000), read_picture);
}

fn exr_picture(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let samples = |scale: f32| FlatSamples::F32((0..108).map(|k| scale * k as f32).collect());
    let half = FlatSamples::F16((0..108).map(|k| exr::prelude::f16::from_f32(k as f32)).collect());
    let channels = [AnyChannel::new("R", samples(0.5)), AnyChannel::new("G", half), AnyChannel::new("B", samples(2.0))];
    let layer = Layer::new(
        (12, 9),
        LayerAttributes::named("light"),
        Encoding { compression, blocks, line_order: LineOrder::Increasing },
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn photon_tallies() {
    let target = Target { name: "photon tally", corpus: vec![tally()], mend: None, memory: exr_memory };
    target.run(cases(3000), |bytes| Read::of(PhotonTally::parse(bytes)));
}

fn tally() -> Vec<u8> {
    let mesh = load::parse(Format::Stl, &exported("stl")).unwrap();
    let block = Block::from_mesh(&mesh).unwrap();
    let window = Window { size_mm: DVec2::new(20.0, 16.0), centre_mm: DVec2::ZERO, nx: 8, ny: 8 };
    let tracer = Tracer::for_block(&block, &Scene::new(1.5, 250.0, window)).unwrap();
    let plan = PhotonPlan::new(1000, 1).with_replicates(4);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tally.exr");
    photons(&tracer, &plan).unwrap().write(&path, "a bench").unwrap();
    fs::read(path).unwrap()
}

/// Gives every chunk of a PNG its checksum.
fn mend_png(file: &mut Vec<u8>) {
    let mut at = 8;
    while let Some(length) = file.get(at..at + 4).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]) as usize) {
        let Some(end) = (at + 8).checked_add(length).filter(|end| end + 4 <= file.len()) else { return };
        let mut crc = crc32(&file[at + 4..end]).to_be_bytes().to_vec();
        file.splice(end..end + 4, crc.drain(..));
        at = end + 4;
    }
}

/// CRC-32 of PNG and ZIP.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    };
    !bytes.iter().fold(!0, step)
}

/// Gives a GLB its lengths.
fn mend_glb(file: &mut [u8]) {
    let Some(name) = file.windows(4).rposition(|w| w == b"BIN\0").filter(|at| *at >= 24) else { return };
    let (total, json, binary) = (file.len(), name - 24, file.len() - name - 4);
    for (at, length) in [(8, total), (12, json), (name - 4, binary)] {
        file[at..at + 4].copy_from_slice(&(length as u32).to_le_bytes());
    }
}

/// The reason why a solid is refused.
#[track_caller]
fn refused(format: Format, bytes: &[u8]) -> String {
    match load::parse(format, bytes) {
        Ok(mesh) => panic!("{format:?} is taken, with {} triangles", mesh.triangles.len()),
        Err(error) => error.to_string(),
    }
}

#[test]
fn solids_that_claim_more_than_they_hold_are_refused_by_name() {
    let mut stl = exported("stl");
    stl[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(refused(Format::Stl, &stl).contains("4294967295 triangles"));
    let ply = QUAD_PLY.replace("vertex 4", "vertex 18446744073709551615");
    assert!(refused(Format::Ply, ply.as_bytes()).contains("ends before its last element"));

    // Many nodes that show one mesh: 100 bytes for each copy of everything.
    let glb = exported("glb");
    let json_length = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
    let mut json: serde_json::Value = serde_json::from_slice(&glb[20..20 + json_length]).unwrap();
    let node = json["nodes"].as_array().unwrap().iter().find(|node| node.get("mesh").is_some()).unwrap().clone();
    json["nodes"] = vec![node; 20_000].into();
    json["scenes"][0]["nodes"] = (0..20_000).collect::<Vec<_>>().into();
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut many = glb[..20].to_vec();
    many.extend(&text);
    many.extend(&glb[20 + json_length..]);
    mend_glb(&mut many);
    assert!(refused(Format::Gltf, &many).contains("more points than it has bytes"));

    // A spline with one span a ten-millionth of the others: sampled at equal steps it takes
    // gigabytes.
    let step = String::from_utf8(exported("step")).unwrap().replace('\n', "");
    let knots = step.find("(4,").map(|at| at + step[at..].find("),(").unwrap() + 3).unwrap();
    // After the multiplicities of the other direction.
    let knots = knots + step[knots..].find("),(").unwrap() + 3;
    let end = knots + step[knots..].find(')').unwrap();
    let mut places: Vec<f64> = step[knots..end].split(',').map(|knot| knot.trim().parse().unwrap()).collect();
    let count = places.len();
    places[count - 2] = places[count - 1] - 1e-7 * (places[count - 1] - places[0]);
    let places: Vec<String> = places.iter().map(|knot| format!("{knot:?}")).collect();
    let uneven = format!("{}{}{}", &step[..knots], places.join(","), &step[end..]);
    let reason = refused(Format::Step, uneven.as_bytes());
    assert!(reason.contains("samples") || reason.contains("more points"), "{reason}");
    // Ellipses by the hundred, which each become thousands of chords.
    let disc = String::from_utf8(exported_of("step", &solid(Outline::Circle))).unwrap();
    let arc = disc[..disc.find("=ELLIPSE").unwrap()].rsplit('#').next().unwrap().to_owned();
    // The first vertex of the entry face, which the ellipse goes through.
    let vertex =
        disc.match_indices("=VERTEX_POINT").nth(4).map(|(at, _)| disc[..at].rsplit('#').next().unwrap()).unwrap();
    let around = disc.find("EDGE_LOOP('',(").unwrap() + "EDGE_LOOP('',(".len();
    let (mut edges, mut names) = (String::new(), String::new());
    for k in (1_000_000..1_001_000).step_by(2) {
        edges +=
            &format!("#{k}=EDGE_CURVE('',#{vertex},#{vertex},#{arc},.T.);#{}=ORIENTED_EDGE('',*,*,#{k},.T.);", k + 1);
        names += &format!("#{},", k + 1);
    }
    let many = format!("{}{names}{}", &disc[..around], &disc[around..]).replacen("DATA;", &format!("DATA;{edges}"), 1);
    let reason = refused(Format::Step, many.as_bytes());
    assert!(reason.contains("more points"), "{reason}");
    let deep = step.replace("CARTESIAN_POINT('',(", &format!("CARTESIAN_POINT('',({}", "(".repeat(10_000)));
    assert!(refused(Format::Step, deep.as_bytes()).contains("not understood"));

    // Spaces by the hundred megabytes in some kilobytes.
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    let relations = "<Relationships><Relationship Target=\"/3D/m.model\" Type=\"x/3dmodel\"/></Relationships>";
    zip.start_file("_rels/.rels", options).unwrap();
    zip.write_all(relations.as_bytes()).unwrap();
    zip.start_file("3D/m.model", options).unwrap();
    (0..100).for_each(|_| zip.write_all(&[b' '; 1 << 20]).unwrap());
    let bomb = zip.finish().unwrap().into_inner();
    assert!(bomb.len() < 1 << 20);
    assert!(refused(Format::ThreeMf, &bomb).contains("200 times its size"));

    let mut png = exported("png");
    png[16..24].copy_from_slice(&[0, 0, 32, 0, 0, 0, 32, 0]);
    mend_png(&mut png);
    assert!(refused(Format::HeightMapPng, &png).contains("too few for 8192 x 8192"));
}

#[test]
fn pictures_that_claim_more_than_is_allowed_are_refused_before_they_are_decoded() {
    let mut png = corpus_of(&["png"]).swap_remove(0);
    png[16..24].copy_from_slice(&[0, 0, 64, 0, 0, 0, 64, 0]);
    mend_png(&mut png);
    let mut bmp = corpus_of(&["bmp"]).pop().unwrap();
    bmp[18..26].copy_from_slice(&[0, 64, 0, 0, 0, 64, 0, 0]);
    let mut gif = corpus_of(&["gif"]).pop().unwrap();
    gif[6..10].copy_from_slice(&[0, 64, 0, 64]);
    let exr = {
        let mut exr = exr_picture(Compression::ZIP16, Blocks::ScanLines);
        for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
            let at = exr.windows(window.len()).position(|w| w == window).unwrap() + window.len() + 4;
            exr[at + 8..at + 16].copy_from_slice(&[0xff, 0x3f, 0, 0, 0xff, 0x3f, 0, 0]);
        }
        exr
    };
    for (name, bytes) in [("PNG", png), ("BMP", bmp), ("GIF", gif), ("OpenEXR", exr)] {
        match read_within(&bytes) {
            Err(PictureError::Memory { width: 16_384, height: 16_384, .. }) => {}
            // Its table of blocks is too short for that.
            Err(PictureError::Broken { .. }) if name == "OpenEXR" => {}
            other => panic!("{name}: {other:?}"),
        }
    }
    let pnm = read_within(b"P5 4000000000 4000000000 255\n1");
    assert!(matches!(pnm, Err(PictureError::Memory { .. } | PictureError::Broken { .. })), "{pnm:?}");
}

/// Found by damaged files: a JPEG of some hundred bytes that takes seconds, and pictures in a
/// drawing whose size is lost in single precision beside their place, at which resvg panics.
#[test]
fn pictures_that_claim_more_than_their_bytes_and_pictures_that_vanish_are_refused_by_both_readers() {
    let refused = |bytes: &[u8], words: [&str; 2]| {
        let designer = read_within(bytes).map(drop).expect_err("taken by the designer's reader").to_string();
        assert!(designer.contains(words[0]), "{designer}");
        let verifier = Reference::parse(bytes, &ReadOptions::default())
            .map(drop)
            .expect_err("taken by the verifier's")
            .to_string();
        assert!(verifier.contains(words[1]), "{verifier}");
    };
    let mut jpeg = corpus_of(&["jpg"]).swap_remove(0);
    // Height and width in the frame header.
    let frame = jpeg.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0x0c, 0, 0x0c, 0]);
    refused(&jpeg, ["hold at most", "claims 3072 x 3072"]);
    // One block, to which the table of blocks points; behind its place and length stand the counters
    // of DWA, the ninth of which counts coefficients.
    let mut exr = exr_picture(Compression::DWAA(None), Blocks::ScanLines);
    let points_behind = |at: &usize| exr[*at..at + 8] == (*at as u64 + 8).to_le_bytes();
    let counters = (0..exr.len() - 8).find(points_behind).unwrap() + 8 + 8;
    assert!(exr.len() - counters < 108 * (4 + 2 + 4), "stored as it is");
    exr[counters + 64..counters + 72].copy_from_slice(&(1_u64 << 57).to_le_bytes());
    refused(&exr, ["144115188075855872 values", "more than its pixels can need"]);
    // One tile, made sixteen million lines high.
    let mut exr = exr_picture(Compression::RLE, Blocks::Tiles(Vec2(64, 64)));
    let name = b"tiles\0tiledesc\0";
    let height = exr.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4 + 4;
    exr[height..height + 4].copy_from_slice(&16_777_280_u32.to_le_bytes());
    refused(&exr, ["64 x 16777280 pixels", "larger than the file can hold"]);
    // A display window of 16 million million pixels, of which 12 x 9 are there.
    let mut exr = exr_picture(Compression::RLE, Blocks::ScanLines);
    let name = b"displayWindow\0box2i\0";
    let corner = exr.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4 + 8;
    exr[corner..corner + 4].copy_from_slice(&3_999_999_i32.to_le_bytes());
    exr[corner + 4..corner + 8].copy_from_slice(&3_999_999_i32.to_le_bytes());
    let refused_by_designer = |bytes: &[u8], words: &str| {
        let said = read_within(bytes).map(drop).expect_err(words).to_string();
        assert!(said.contains(words), "{said}");
    };
    refused_by_designer(&exr, "4000000 x 4000000 pixels, of which it holds 12 x 9");
    // A palette that ends within a colour.
    let palette = corpus_of(&["png"]).into_iter().find(|png| png.windows(4).any(|w| w == b"PLTE")).unwrap();
    let at = palette.windows(4).position(|w| w == b"PLTE").unwrap();
    let length = u32::from_be_bytes(palette[at - 4..at].try_into().unwrap()) as usize;
    let mut png = [&palette[..at + 4 + length], &[0], &palette[at + 4 + length..]].concat();
    png[at - 4..at].copy_from_slice(&(length as u32 + 1).to_be_bytes());
    mend_png(&mut png);
    refused_by_designer(&png, "ends within a colour");
    let drawing = kinds_of(&["svg"]).into_iter().filter_map(|bytes| String::from_utf8(bytes).ok());
    let drawing = drawing.into_iter().find(|text| text.contains("<image ")).unwrap();
    let image = &drawing[drawing.find("<image ").unwrap()..];
    let height = image.split("height=\"").nth(1).unwrap().split('"').next().unwrap();
    let tall = image.replacen(&format!("height=\"{height}\""), "height=\"4294967295\"", 1);
    refused(drawing.replace(image, &tall).as_bytes(), ["4294967295", "too small for where it stands"]);
    refused(drawing.replace(" x=\"", " x=\"-1e30").as_bytes(), ["whose x is", "too small for where it stands"]);
}

/// What of a program is cut, on a small sheet.
struct Cutting {
    sheet: Sheet,
    strokes: Strokes,
}

impl Run for Cutting {
    fn moved(&mut self, made: &Move) -> Result<(), ProgramFault> {
        let (low, high) = (self.sheet.plan().lower, self.sheet.plan().upper);
        if made.feeds() && self.strokes.comes_near(made, 0, (low, high), 0.0) {
            self.strokes.add(made, 0);
        }
        if self.strokes.len() > 4096 {
            self.sheet.cut(&self.strokes);
            self.strokes.clear();
        }
        Ok(())
    }
}

fn read_program(bytes: &[u8]) -> Read {
    let (low, high) = (DVec2::splat(-10.0), DVec2::splat(10.0));
    let limits = SurveyLimits { face: (low, high), top_mm: 0.0 };
    let dynamics = Dynamics { acceleration: 500.0, rapid_feed: 5000.0, corner_mm: 0.01 };
    let Ok(found) = survey(bytes, None, limits, dynamics) else { return Read::Refused };
    assert!(!found.seconds.is_nan() && found.seconds >= 0.0 && found.feed_mm >= 0.0);
    let plan = Plan { lower: low, upper: high, nodes: (40, 40) };
    let strokes = Strokes::of(&[Tool::ball(1.5)]).within(low, high);
    let mut cutting = Cutting { sheet: Sheet::level(plan, 0.0).unwrap(), strokes };
    run(bytes, None, &mut cutting).unwrap();
    cutting.sheet.cut(&cutting.strokes);
    assert!(cutting.sheet.into_cut().heights.iter().all(|height| *height <= 0.0));
    Read::Taken
}

const PROGRAMS: [&str; 4] = [
    "%\nO0001 (T1 D=6. CR=3. - BALL)\nN10 G21 G90 G94 G17 G40 G49 G80 G54\nT1 M6\nS18000 M3\nG0 G43 H1 Z5.\nG0 X-10. Y-10.\n\
     G1 Z-1. F500.\nX10.25 Z-1.125\nY-9.5\nX-10. Z-0.875\nG2 X0. Y0. I5. J4.75\nG3 X5. Y5. R6.\nG0 Z5.\nG53 G0 Z0.\nM30\n%\n",
    "G20 G91.1\nG0 Z.2 ; up\nX0 Y0\nG18 G2 X.3 Z.2 I.15 K0 F20\nG19 G3 Y.2 Z.1 R.3\nG17 G61 G3 I.1 J.1\nG92 X0\nG1 X.5\nG92.1\nG28 Z1\nM2\n",
    "(tool: vee:60deg,d6mm)\ng21 g91\ng92 x0 y0 z0\ng0 z1\ng93 g1 x3 z-2 f2\ny1 f3\ng94 f100\ng64 p0.01\nx-3\ng4 p1\nm5\n",
    "G21\nG52 X1\nG0 X0 Y0 Z0\nG90.1 G2 X4 Y0 I2 J0 F100\nG1 Z-3\nX-4\nM2\n",
];

#[test]
fn programs() {
    let corpus = PROGRAMS.map(|program| program.as_bytes().to_vec()).to_vec();
    // Moves are never kept: the sheet, a batch, and the tables of the survey.
    let memory: fn(usize) -> usize = |length| (16 << 20) + 400 * length;
    Target { name: "program of a machine", corpus, mend: None, memory }.run(cases(20_000), read_program);
}
