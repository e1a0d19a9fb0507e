use super::{Design, ExportError};
use crate::{
    bench::ExitFace,
    solid::{Face, Origin, Solid},
};
use gltf::binary::{Glb, Header};
use gltf_json::{
    Accessor, Asset, Buffer, Index, Material, Mesh, Node, Root, Scene,
    accessor::{ComponentType, GenericComponentType, Type},
    buffer::{Target, View},
    extensions::material as extension,
    material::{PbrMetallicRoughness, StrengthFactor},
    mesh::{Mode, Primitive, Semantic},
    validation::{Checked::Valid, USize64},
};
use rayon::prelude::*;
use std::{
    collections::{BTreeMap, HashMap},
    io::{self, Write},
};

/// Most vertices that are written: a gigabyte of file. Common viewers give up earlier; twice as
/// many again and the 32-bit lengths of the container overflow.
const MOST_VERTICES: usize = 20_000_000;

/// How far light goes in the glass, m, until it has taken on [`ATTENUATION_COLOUR`]: about what
/// clear acrylic does.
const ATTENUATION_DISTANCE_M: f32 = 1.0;
const ATTENUATION_COLOUR: [f32; 3] = [0.97, 0.985, 0.98];

/// Refuses a block of too many vertices.
pub(super) fn check(solid: &Solid) -> Result<(), ExportError> {
    let (vertices, most) = (vertex_count(solid), MOST_VERTICES);
    if vertices > most { Err(ExportError::TooManyForGlb { vertices, most }) } else { Ok(()) }
}

/// Every face has vertices of its own, because normals differ along its border.
fn vertex_count(solid: &Solid) -> usize {
    if solid.contour().is_some() {
        // The border of the exit face once more for the wall, which has all of the entry face's but
        // its middle too.
        return solid.vertex_count() + 2 * (solid.vertex_count() - solid.exit_vertex_count() - 1);
    }
    let ((nx, ny), (ex, ey)) = (solid.exit_nodes(), solid.entry_nodes());
    // Of a rim's few vertices each is counted once: the limit is a round number.
    nx * ny + 2 * (nx + ny) + 2 * (ex + ey) + (solid.vertex_count() - nx * ny)
}

/// Writes binary glTF 2.0: metres, y up, so that (x, y, z) of the library is (x, z, -y) / 1000 in
/// the file. Reliefs have the normals of the smooth surface, the planes their own; the
/// material is clear glass of the design's index.
///
/// # Errors
/// Those of the writer; [`io::ErrorKind::InvalidInput`] for more than 20 million vertices.
pub fn write_glb(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    check(solid).map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
    let mesh = SplitMesh::new(solid);
    let (json, bin) = (mesh.root(solid, design)?, mesh.binary(solid));
    // The encoder computes the lengths itself.
    let header = Header { magic: *b"glTF", version: 2, length: 0 };
    let glb = Glb { header, json: json.into(), bin: Some(bin.into()) };
    glb.to_writer(&mut *writer).map_err(|error| match error {
        gltf::Error::Io(error) => error,
        other => io::Error::other(other),
    })?;
    writer.flush()
}

/// A point of the library's frame, mm, in that of the file, m.
fn metres([x, y, z]: [f32; 3]) -> [f32; 3] {
    y_up([x, y, z].map(|c| (f64::from(c) / 1000.0) as f32))
}

/// A direction of the library's frame in that of the file. `+ 0.0` turns a negative zero into a
/// positive one.
fn y_up([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, z, -y + 0.0]
}

/// A face with vertices of its own.
struct Plane {
    face: Face,
    /// Vertices of the solid.
    vertices: Vec<u32>,
    /// Triangles, by places in `vertices`.
    triangles: Vec<[u32; 3]>,
}

/// The exit face as it is, then the planes.
struct SplitMesh {
    exit_vertices: usize,
    exit_triangles: usize,
    planes: Vec<Plane>,
}

impl SplitMesh {
    fn new(solid: &Solid) -> Self {
        let mut faces = solid.faces().into_iter();
        let exit_triangles = faces.next().map_or(0, |(_, exit)| exit.len());
        let planes = faces.map(|(face, range)| {
            let (mut vertices, mut places) = (Vec::new(), HashMap::new());
            let mut place = |v: u32| {
                *places.entry(v).or_insert_with(|| {
                    vertices.push(v);
                    vertices.len() as u32 - 1
                })
            };
            let triangles = range.map(|t| solid.triangle(t).map(&mut place)).collect();
            Plane { face, vertices, triangles }
        });
        Self { exit_vertices: solid.exit_normals().len(), exit_triangles, planes: planes.collect() }
    }

    fn vertices(&self) -> usize {
        self.exit_vertices + self.planes.iter().map(|plane| plane.vertices.len()).sum::<usize>()
    }

    fn triangles(&self) -> usize {
        self.exit_triangles + self.planes.iter().map(|plane| plane.triangles.len()).sum::<usize>()
    }

    /// Positions, normals, indices: each little-endian and without gaps.
    fn binary(&self, solid: &Solid) -> Vec<u8> {
        const TRIPLE: usize = 12;
        let mut bytes = vec![0; TRIPLE * (2 * self.vertices() + self.triangles())];
        let (positions, rest) = bytes.split_at_mut(TRIPLE * self.vertices());
        let (normals, indices) = rest.split_at_mut(TRIPLE * self.vertices());
        let fill = |bytes: &mut [u8], triple: &(dyn Fn(usize) -> [[u8; 4]; 3] + Sync)| {
            bytes.par_chunks_mut(TRIPLE).with_min_len(1 << 10).enumerate().for_each(|(k, out)| {
                out.copy_from_slice(triple(k).as_flattened());
            });
        };
        let (exit_positions, mut positions) = positions.split_at_mut(TRIPLE * self.exit_vertices);
        let (exit_normals, mut normals) = normals.split_at_mut(TRIPLE * self.exit_vertices);
        let (exit_indices, mut indices) = indices.split_at_mut(TRIPLE * self.exit_triangles);
        fill(exit_positions, &|v| metres(solid.vertex(v)).map(f32::to_le_bytes));
        fill(exit_normals, &|v| y_up(solid.exit_normals()[v]).map(f32::to_le_bytes));
        fill(exit_indices, &|t| solid.triangle(t).map(u32::to_le_bytes));
        let mut first = self.exit_vertices as u32;
        for plane in &self.planes {
            let take = |bytes: &mut &mut [u8], triples: usize, triple: &(dyn Fn(usize) -> [[u8; 4]; 3] + Sync)| {
                let (mine, rest) = std::mem::take(bytes).split_at_mut(TRIPLE * triples);
                fill(mine, triple);
                *bytes = rest;
            };
            let (vertices, triangles) = (&plane.vertices, &plane.triangles);
            take(&mut positions, vertices.len(), &|k| metres(solid.vertex(vertices[k] as usize)).map(f32::to_le_bytes));
            take(&mut normals, vertices.len(), &|k| {
                y_up(solid.normal_at(plane.face, vertices[k])).map(f32::to_le_bytes)
            });
            take(&mut indices, triangles.len(), &|k| triangles[k].map(|v| (first + v).to_le_bytes()));
            first += vertices.len() as u32;
        }
        bytes
    }

    fn root(&self, solid: &Solid, design: &Design) -> io::Result<Vec<u8>> {
        let (vertices, triangles) = (self.vertices(), self.triangles());
        let mut root = Root { asset: asset(solid, design)?, ..Root::default() };
        let name = Some(design.name.clone()).filter(|name| !name.is_empty());
        let buffer = root.push(Buffer {
            byte_length: USize64::from(12 * (2 * vertices + triangles)),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut offset = 0;
        let mut accessor = |root: &mut Root, count: usize, bytes: usize, of: Of| {
            let (target, component, type_) = match of {
                Of::Vertices(_) => (Target::ArrayBuffer, ComponentType::F32, Type::Vec3),
                Of::Indices => (Target::ElementArrayBuffer, ComponentType::U32, Type::Scalar),
            };
            let view = root.push(View {
                buffer,
                byte_length: USize64::from(bytes),
                byte_offset: Some(USize64::from(offset)),
                byte_stride: None,
                name: None,
                target: Some(Valid(target)),
                extensions: None,
                extras: None,
            });
            offset += bytes;
            let bounds = if let Of::Vertices(bounds) = of { bounds } else { None };
            root.push(Accessor {
                buffer_view: Some(view),
                byte_offset: None,
                count: USize64::from(count),
                component_type: Valid(GenericComponentType(component)),
                extensions: None,
                extras: None,
                type_: Valid(type_),
                min: bounds.map(|(min, _)| serde_json::json!(min)),
                max: bounds.map(|(_, max)| serde_json::json!(max)),
                name: None,
                normalized: false,
                sparse: None,
            })
        };
        let positions = accessor(&mut root, vertices, 12 * vertices, Of::Vertices(Some(bounds(solid))));
        let normals = accessor(&mut root, vertices, 12 * vertices, Of::Vertices(None));
        let indices = accessor(&mut root, 3 * triangles, 12 * triangles, Of::Indices);
        let material = root.push(material(solid, design.exit_face));
        root.extensions_used = match design.exit_face {
            ExitFace::Refracts { .. } => ["transmission", "ior", "volume"].map(|e| format!("KHR_materials_{e}")).into(),
            ExitFace::Reflects => Vec::new(),
        };
        let mesh = root.push(Mesh {
            extensions: None,
            extras: None,
            name: name.clone(),
            primitives: vec![Primitive {
                attributes: BTreeMap::from([
                    (Valid(Semantic::Positions), positions),
                    (Valid(Semantic::Normals), normals),
                ]),
                extensions: None,
                extras: None,
                indices: Some(indices),
                material: Some(material),
                mode: Valid(Mode::Triangles),
                targets: None,
            }],
            weights: None,
        });
        let node = root.push(Node { mesh: Some(mesh), name, ..Node::default() });
        root.scene = Some(Index::push(
            &mut root.scenes,
            Scene { extensions: None, extras: None, name: None, nodes: vec![node] },
        ));
        Ok(gltf_json::serialize::to_vec(&root)?)
    }
}

/// What an accessor is for; positions have bounds.
enum Of {
    Vertices(Option<([f32; 3], [f32; 3])>),
    Indices,
}

/// Least and greatest coordinates in the file.
fn bounds(solid: &Solid) -> ([f32; 3], [f32; 3]) {
    let (low, high) = solid.bounds();
    // The turn to y up swaps and negates: order the corners afterwards.
    let (low, high) = (metres(low), metres(high));
    let ordered = |pick: fn(f32, f32) -> f32| [0, 1, 2].map(|k| pick(low[k], high[k]));
    (ordered(f32::min), ordered(f32::max))
}

fn asset(solid: &Solid, design: &Design) -> io::Result<Asset> {
    let extent = solid.extent();
    let ior = match design.exit_face {
        ExitFace::Refracts { ior } => Some(ior),
        ExitFace::Reflects => None,
    };
    let extras = serde_json::json!({
        "design": design.name,
        "frame": frame(solid),
        "size_mm": [extent.width_mm, extent.height_mm, solid.thickness_mm()],
        "exit_face": if ior.is_some() { "refracts" } else { "reflects" },
        "ior": ior,
        "distance_mm": design.distance_mm,
    });
    Ok(Asset {
        generator: Some(concat!("glasswarp ", env!("CARGO_PKG_VERSION")).to_owned()),
        extras: Some(serde_json::value::to_raw_value(&extras)?),
        ..Asset::default()
    })
}

fn frame(solid: &Solid) -> String {
    if solid.shape().origin == Origin::Exit {
        return "metres, +Y up, light travels +Y, receiver at Y = distance_mm / 1000".to_owned();
    }
    let exit_z_mm = -solid.origin_mm().z;
    format!(
        "metres, +Y up, light travels +Y, mean exit plane at Y = {exit_z_mm} / 1000, receiver at Y = ({exit_z_mm} + distance_mm) / 1000, origin {}",
        solid.shape().origin.place()
    )
}

fn material(solid: &Solid, exit_face: ExitFace) -> Material {
    let surface = |metallic| PbrMetallicRoughness {
        metallic_factor: StrengthFactor(metallic),
        roughness_factor: StrengthFactor(0.0),
        ..PbrMetallicRoughness::default()
    };
    match exit_face {
        ExitFace::Reflects => {
            Material { name: Some("mirror".to_owned()), pbr_metallic_roughness: surface(1.0), ..Material::default() }
        }
        ExitFace::Refracts { ior } => Material {
            name: Some("glass".to_owned()),
            pbr_metallic_roughness: surface(0.0),
            extensions: Some(extension::Material {
                transmission: Some(extension::Transmission {
                    transmission_factor: extension::TransmissionFactor(1.0),
                    ..extension::Transmission::default()
                }),
                ior: Some(extension::Ior {
                    ior: extension::IndexOfRefraction(ior as f32),
                    ..extension::Ior::default()
                }),
                volume: Some(extension::Volume {
                    // The mean thickness: the mean exit plane is at 0.
                    thickness_factor: extension::ThicknessFactor((-solid.entry_z_mm() / 1000.0) as f32),
                    attenuation_distance: extension::AttenuationDistance(ATTENUATION_DISTANCE_M),
                    attenuation_color: extension::AttenuationColor(ATTENUATION_COLOUR),
                    ..extension::Volume::default()
                }),
            }),
            ..Material::default()
        },
    }
}
