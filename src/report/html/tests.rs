use super::{
    rays::{RayFan, look, window_corners},
    section::{Across, section},
    *,
};
use crate::{
    bench::{Bench, ExitFace},
    grid::{Extent, Field},
    light::Intensity,
    report::{CostErrors, Drawing, Isocontours},
    solid::{Shape, Solid, Stock},
    surface::HeightField,
};
use glam::{DVec2, DVec3};
use image::GrayImage;

const BLOCK: Extent = Extent::new(60.0, 40.0);
const ENTRY_MM: f64 = -8.0;

fn glass() -> Bench {
    Bench::new(BLOCK, 200.0, ExitFace::Refracts { ior: 1.5 }).unwrap()
}

/// A block whose face rises by `slope` along x, on a bench.
struct Sample {
    surface: HeightField,
    bench: Bench,
    slope: Field<f64>,
    hollow: Field<f64>,
    contours: Isocontours,
}

impl Sample {
    fn new(bench: Bench, slope: f64) -> Self {
        let surface = HeightField::new(BLOCK, Field::from_fn(31, 21, |i, j| slope * BLOCK.node(i, j, 31, 21).x));
        let field = |value: f64| Field::filled(31, 21, value);
        let contours = Isocontours::of(&surface);
        Self { surface, bench, slope: field(slope.abs()), hollow: field(0.0), contours }
    }

    fn model(&self) -> Model<'_> {
        Model {
            surface: &self.surface,
            entry_z_mm: ENTRY_MM,
            outline: vec![
                DVec2::new(-30.0, -20.0),
                DVec2::new(30.0, -20.0),
                DVec2::new(30.0, 20.0),
                DVec2::new(-30.0, 20.0),
            ],
            rim_z_mm: None,
            bench: &self.bench,
            slope: &self.slope,
            hollow_per_mm: &self.hollow,
            contours: &self.contours,
        }
    }

    fn page(&self) -> Page<'_> {
        let view = |title: &str| View {
            title: title.into(),
            note: "a note".into(),
            alt: format!("{title}, in shades of grey"),
            picture: GrayImage::from_fn(60, 40, |i, j| image::Luma([(4 * i + j) as u8])),
        };
        Page {
            title: "<b>Tom & \"Jerry\"</b>".into(),
            about: "About <script>alert(1)</script>".into(),
            verdict: Some(TrafficLight {
                question: "Will it work?".into(),
                answer: "yes, but",
                class: "but",
                says: "a <little>".into(),
            }),
            warnings: vec!["too <thin>".into()],
            highlights: vec![Highlight { label: "a".into(), value: "1".into(), unit: "mm".into(), note: "b".into() }],
            model: self.model(),
            target: Some(view("Target")),
            caustic: view("Light"),
            moving: Err("the lamp"),
            maker: vec![Facts { title: "Stock to order".into(), rows: vec![("sheet".into(), "12 mm".into())] }],
            difference: Some(view("Difference")),
            others: vec![(view("on the plane"), view("its difference"))],
            budget: vec![Cost {
                name: "a step".into(),
                errors: Some(CostErrors { rel_rms: 0.01, ssim: 0.9, moved: 0.001 }),
            }],
            summary: None,
            drawing: Some(self.drawing()),
            facts: vec![Facts { title: "Block".into(), rows: vec![("size".into(), "60 × 40 mm".into())] }],
            files: vec![FileRecord { name: "b.stl".into(), what: "mesh".into(), bytes: 12_345, sha256: "ab".into() }],
            command: "glasswarp design 'my picture.png'".into(),
            program: "glasswarp 0".into(),
        }
    }

    fn drawing(&self) -> Drawing {
        let solid = Solid::shaped(&self.surface, Stock::of_thickness(12.0), Shape::default()).unwrap();
        Drawing::of(&solid, &self.bench, &["order: a <sheet>".to_owned()])
    }

    fn fan(&self) -> RayFan {
        RayFan::of(&SurfaceSpline::through(&self.surface), &self.model())
    }

    fn section(&self, across: Across) -> String {
        let spline = SurfaceSpline::through(&self.surface);
        section(&self.model(), &spline, &self.fan(), across)
    }
}

#[test]
fn the_page_asks_for_nothing_and_takes_words_as_words() {
    let sample = Sample::new(glass(), 0.02);
    let html = render(&sample.page());
    for absent in ["http:", "https:", "<b>Tom", "<script>alert", "<thin>", "@import", "url("] {
        assert!(!html.contains(absent), "{absent}");
    }
    for present in
        ["&#60;b&#62;Tom &#38; &#34;Jerry&#34;", "too &#60;thin&#62;", "One warning", "12.3\u{a0}kB", "60 × 40 mm"]
    {
        assert!(html.contains(present), "{present}");
    }
    let place = |words: &str| html.find(words).unwrap();
    assert!(place("<b>yes, but</b>") < place("One warning"), "the verdict comes first");
    assert!(place("One warning") < place("id=\"light\""), "warnings come before pictures");
    // What the maker needs comes first, and what the engineer asks is folded.
    let order = [
        "id=\"light\"",
        "id=\"model\"",
        "id=\"make\"",
        "Stock to order",
        "order: a &#60;sheet&#62;",
        "id=\"files\"",
        "<details id=\"engineer\">",
        "id=\"differences\"",
        "id=\"face\"",
        "id=\"bench\"",
        "60 × 40 mm</td>",
        "id=\"accuracy\"",
        "</main>",
    ];
    for pair in order.windows(2) {
        assert!(place(pair[0]) < place(pair[1]), "{pair:?}");
    }
    let links: Vec<&str> = html.split("href=\"#").skip(1).map(|rest| rest.split_once('"').unwrap().0).collect();
    assert!(links.len() > 5 && links.iter().all(|id| html.contains(&format!("id=\"{id}\""))), "{links:?}");
    // What is of the face is seen from above it, what is of light as on the wall; both say so.
    assert_eq!(html.matches("; seen from above the face").count(), 4, "three maps and the drawing");
    assert!(html.contains("Seen as on the wall") && html.contains("</b>, as on the wall"));
    let scene = html.split_once("id=\"scene\">").unwrap().1.split_once("</script>").unwrap().0;
    let scene: serde_json::Value = serde_json::from_str(scene).unwrap();
    assert_eq!((scene["nodes"][0].as_u64(), scene["nodes"][1].as_u64()), (Some(31), Some(21)));
    // The face rises from -0.6 to 0.6 mm, in steps of 1/65535 of that.
    let range = [0, 1].map(|k| scene["range"][k].as_f64().unwrap());
    assert!((range[0] + 0.6).abs() < 1e-9 && (range[1] - 0.6).abs() < 1e-9, "{range:?}");
    let heights =
        base64::Engine::decode(&base64::engine::general_purpose::STANDARD, scene["heights"].as_str().unwrap()).unwrap();
    assert_eq!((heights.len(), &heights[..2], &heights[60..62]), (2 * 31 * 21, &[0, 0][..], &[255, 255][..]));
}

#[test]
fn every_image_has_words_in_its_place() {
    let sample = Sample::new(glass(), 0.02);
    let html = render(&sample.page());
    let images: Vec<&str> = html.split("<img").skip(1).map(|rest| &rest[..rest.find('>').unwrap()]).collect();
    assert_eq!(images.len(), 3 + 2 + 3 + 1);
    assert!(images.iter().all(|image| image.contains("alt=\"") && !image.contains("alt=\"\"")));
}

#[test]
fn rays_follow_the_light_of_every_bench() {
    // A wedge turns straight light by (n - 1) times its slope, towards where it is thicker.
    let wedge = Sample::new(glass(), 0.02);
    let fan = wedge.fan();
    let ray = fan.middle(true).nth(10).unwrap();
    let (start, entry, exit, landing) = (ray[0], ray[1], ray[2], ray[3]);
    assert!((start - entry).truncate().length() < 1e-12 && entry.z == ENTRY_MM && start.z < ENTRY_MM);
    assert!(((landing - exit).x / 200.0 - 0.01).abs() < 1e-4 && (landing.z - 200.0).abs() < 1e-9, "{ray:?}");

    // From the side, Snell's law holds at both planar faces, which leave the direction as it was.
    let tangential = 0.5 / 1.5;
    let inside = DVec3::new(tangential, 0.0, (1.0_f64 - tangential * tangential).sqrt());
    let tilted = Sample::new(glass().with_light_direction(inside).unwrap(), 0.0);
    for ray in tilted.fan().some() {
        let (before, after) = ((ray[1] - ray[0]).normalize(), (ray[3] - ray[2]).normalize());
        assert!((before.x - 0.5).abs() < 1e-9 && (before - after).length() < 1e-9);
        assert!(((ray[2] - ray[1]).normalize() - inside).length() < 1e-9);
    }

    let source = DVec3::new(10.0, 0.0, -150.0);
    let near = Sample::new(glass().with_point_source(source, -ENTRY_MM, Intensity::Isotropic).unwrap(), 0.0);
    for ray in near.fan().some() {
        assert_eq!(ray[0], source);
        // The sines on both sides of the entry face.
        let sines = [ray[1] - ray[0], ray[2] - ray[1]].map(|way| way.normalize().truncate().length());
        assert!((sines[0] - 1.5 * sines[1]).abs() < 1e-7, "{sines:?}");
    }

    let leaning = Sample::new(glass().with_receiver_turned(DVec3::new(0.0, 0.3, 0.0)).unwrap(), 0.0);
    for ray in leaning.fan().some() {
        assert!((ray[3].z - 200.0 + ray[3].x * 0.3_f64.tan()).abs() < 1e-9, "{:?}", ray[3]);
    }
    let [top_left, top_right, ..] = window_corners(&leaning.bench);
    assert!(top_left.x > top_right.x && top_left.z < top_right.z && (top_left.distance(top_right) - 60.0).abs() < 1e-9);

    let mirror = Sample::new(Bench::new(BLOCK, 200.0, ExitFace::Reflects).unwrap(), 0.0);
    for ray in mirror.fan().some() {
        assert!(ray[0].z > 0.0 && ray[1] == ray[2] && (ray[3].z - 200.0).abs() < 1e-9);
    }
}

#[test]
fn at_first_neither_block_nor_picture_hides_the_other_and_the_face_is_not_edge_on() {
    let tangential = 0.5 / 1.5;
    let inside = DVec3::new(0.0, tangential, (1.0_f64 - tangential * tangential).sqrt());
    let bench = |distance: f64| Bench::new(BLOCK, distance, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let benches = [bench(80.0), bench(200.0), bench(3000.0), glass().with_light_direction(inside).unwrap()];
    for bench in benches {
        let sample = Sample::new(bench, 0.02);
        let model = sample.model();
        let eye = look(&model);
        assert!((eye.length() - 1.0).abs() < 1e-12 && eye.z < -0.24, "from behind the block, and not along its face");
        // In the plane of the picture that an eye far away sees.
        let (right, up) = (DVec3::Y.cross(eye).normalize(), eye.cross(DVec3::Y.cross(eye).normalize()));
        let block = model.outline.iter().flat_map(|p| [ENTRY_MM, 0.6].map(|z| p.extend(z)));
        let block: Vec<DVec3> = block.collect();
        let picture = window_corners(&sample.bench);
        let apart = [right, up].into_iter().any(|axis| {
            let along = |points: &[DVec3]| points.iter().map(|p| p.dot(axis)).collect::<Vec<f64>>();
            let (one, other) = (along(&block), along(&picture));
            one.iter().all(|a| other.iter().all(|b| a < b)) || one.iter().all(|a| other.iter().all(|b| a > b))
        });
        assert!(apart, "{} mm: {eye}", sample.bench.distance_mm());
    }
}

#[test]
fn sections_give_every_dimension_of_every_bench() {
    let straight = Sample::new(glass(), 0.02);
    let x = straight.section(Across::X);
    for part in ["200\u{a0}mm to the mean exit plane", "8.6\u{a0}mm thick", "60\u{a0}mm", "along the axis", "to scale"]
    {
        assert!(x.contains(part), "{part} is not in\n{x}");
    }
    assert!(straight.section(Across::Y).contains(">40\u{a0}mm<"));

    let wide = glass().with_window(Extent::new(90.0, 60.0), DVec2::ZERO).unwrap();
    assert!(Sample::new(wide, 0.0).section(Across::X).contains(">90\u{a0}mm<"));

    let leaning = glass().with_receiver_turned(DVec3::new(0.0, 0.3, 0.0)).unwrap();
    let leaning = Sample::new(leaning, 0.0);
    assert!(leaning.section(Across::X).contains("receiver leans by 17.19°"));
    assert!(!leaning.section(Across::Y).contains("leans"));

    let tangential = 0.5 / 1.5;
    let inside = DVec3::new(0.0, tangential, (1.0_f64 - tangential * tangential).sqrt());
    let tilted = Sample::new(glass().with_light_direction(inside).unwrap(), 0.0);
    assert!(tilted.section(Across::Y).contains("parallel light at 30° to the axis"));
    assert!(tilted.section(Across::X).contains("along the axis"));

    let source = DVec3::new(0.0, 0.0, -158.0);
    let near = Sample::new(glass().with_point_source(source, 8.0, Intensity::Isotropic).unwrap(), 0.0);
    let x = near.section(Across::X);
    assert!(x.contains("150\u{a0}mm from the light to the entry face") && x.contains("class=\"source\""), "{x}");

    let mirror = Sample::new(Bench::new(BLOCK, 200.0, ExitFace::Reflects).unwrap(), 0.0);
    assert!(!mirror.section(Across::X).contains("thick"), "a mirror has no entry face");
}
