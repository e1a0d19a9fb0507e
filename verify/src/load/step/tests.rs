use super::*;
use crate::{block::Block, solid};
use glam::DVec2;
use proptest::prelude::*;

/// A block of 4 x 2 x 1 mm whose top is a net of degree 1.
fn block() -> String {
    let mut text = String::from("ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n");
    let corners = [(0., 0.), (4., 0.), (4., 2.), (0., 2.)];
    for (k, (x, y)) in corners.iter().enumerate() {
        text += &format!("#{}=CARTESIAN_POINT('',({x:?},{y:?},0.));#{}=VERTEX_POINT('',#{0});\n", k + 1, k + 11);
        text +=
            &format!("#{}=CARTESIAN_POINT('it''s; one',({x:?},{y:?},1.));#{}=VERTEX_POINT('',#{0});\n", k + 5, k + 15);
    }
    text += "#30=LINE('',#1,$);\n";
    let edge = |n: usize, a: usize, b: usize| format!("#{n}=EDGE_CURVE('',#{a},#{b},#30,.T.);\n");
    for k in 0..4 {
        let next = (k + 1) % 4;
        text += &edge(40 + k, 11 + k, 11 + next);
        text += &edge(50 + k, 15 + k, 15 + next);
        text += &edge(60 + k, 11 + k, 15 + k);
    }
    let mut number = 100;
    let mut face = |surface: usize, edges: [(usize, &str); 4]| {
        let mut text = String::new();
        for (k, (edge, sense)) in edges.iter().enumerate() {
            text += &format!("#{}=ORIENTED_EDGE('',*,*,#{edge},.{sense}.);\n", number + k);
        }
        let n = number;
        number += 10;
        text += &format!("#{}=EDGE_LOOP('',(#{n},#{},#{},#{}));\n", n + 4, n + 1, n + 2, n + 3);
        text + &format!(
            "#{}=FACE_OUTER_BOUND('',#{},.T.);\n#{}=ADVANCED_FACE('',(#{0}),#{surface},.T.);\n",
            n + 5,
            n + 4,
            n + 6
        )
    };
    text += &face(31, [(43, "F"), (42, "F"), (41, "F"), (40, "F")]);
    text += &face(32, [(50, "T"), (51, "T"), (52, "T"), (53, "T")]);
    for k in 0..4 {
        text += &face(31, [(40 + k, "T"), (60 + (k + 1) % 4, "T"), (50 + k, "F"), (60 + k, "F")]);
    }
    text += "#31=PLANE('',#30);\n";
    text += "#32=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#5,#8),(#6,#7)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);\n";
    text += "#33=CLOSED_SHELL('',(#106,#116,#126,#136,#146,#156));\n#34=MANIFOLD_SOLID_BREP('',#33);\n";
    text + "#35=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\nENDSEC;\nEND-ISO-10303-21;\n"
}

/// Height of a control point of the lower (0) or upper (1) face of a block of 6 x 3 mm.
fn control(side: usize, i: usize, j: usize) -> f64 {
    [-2.0, 0.0][side] + 0.1 * ((3 * i + 5 * j + 2 * side) % 7) as f64
}

/// A block whose faces below and above are bicubic patches.
fn two_patches() -> String {
    let mut text =
        block().lines().take(5).collect::<Vec<_>>().join("\n") + "\n#30=LINE('',#200,$);\n#31=PLANE('',#30);\n";
    let point = |side: usize, (i, j): (usize, usize)| 200 + 1000 * side + 10 * i + j;
    let corners = [(0, 0), (3, 0), (3, 3), (0, 3)];
    let mut loops = Vec::new();
    for side in [0, 1] {
        for k in 0..16 {
            let (i, j) = (k / 4, k % 4);
            let at = (2.0 * i as f64, j as f64, control(side, i, j));
            text += &format!("#{}=CARTESIAN_POINT('',({:?},{:?},{:?}));\n", point(side, (i, j)), at.0, at.1, at.2);
        }
        let vertex = |corner: (usize, usize)| point(side, corner) + 5000;
        for corner in corners {
            text += &format!("#{}=VERTEX_POINT('',#{});\n", vertex(corner), point(side, corner));
        }
        for (k, from) in corners.into_iter().enumerate() {
            let to = corners[(k + 1) % 4];
            let along = [0, 1, 2, 3].map(|m| ((from.0 * (3 - m) + to.0 * m) / 3, (from.1 * (3 - m) + to.1 * m) / 3));
            let [a, b, c, d] = along.map(|at| point(side, at));
            let n = 10 + 4 * side + k;
            text += &format!(
                "#{}=B_SPLINE_CURVE_WITH_KNOTS('',3,(#{a},#{b},#{c},#{d}),.UNSPECIFIED.,.F.,.F.,(4,4),(0.,1.),.UNSPECIFIED.);\n",
                n + 50
            );
            text += &format!("#{n}=EDGE_CURVE('',#{},#{},#{},.T.);\n", vertex(from), vertex(to), n + 50);
        }
        let rows = [0, 1, 2, 3].map(|i| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|j| point(side, (i, j)));
            format!("(#{a},#{b},#{c},#{d})")
        });
        text += &format!(
            "#{}=B_SPLINE_SURFACE_WITH_KNOTS('',3,3,({}),.UNSPECIFIED.,.F.,.F.,.F.,(4,4),(4,4),(0.,1.),(0.,1.),.UNSPECIFIED.);\n",
            40 + side,
            rows.join(",")
        );
    }
    for (k, corner) in corners.into_iter().enumerate() {
        text +=
            &format!("#{}=EDGE_CURVE('',#{},#{},#30,.T.);\n", 20 + k, point(0, corner) + 5000, point(1, corner) + 5000);
        loops.push((31, "T", [(10 + k, "T"), (20 + (k + 1) % 4, "T"), (14 + k, "F"), (20 + k, "F")]));
    }
    loops.push((40, "F", [(13, "F"), (12, "F"), (11, "F"), (10, "F")]));
    loops.push((41, "T", [(14, "T"), (15, "T"), (16, "T"), (17, "T")]));
    let mut faces = Vec::new();
    for (k, (surface, sense, edges)) in loops.into_iter().enumerate() {
        let n = 100 + 10 * k;
        for (m, (edge, sense)) in edges.into_iter().enumerate() {
            text += &format!("#{}=ORIENTED_EDGE('',*,*,#{edge},.{sense}.);\n", n + m);
        }
        text += &format!("#{}=EDGE_LOOP('',(#{n},#{},#{},#{}));\n", n + 4, n + 1, n + 2, n + 3);
        text += &format!(
            "#{}=FACE_OUTER_BOUND('',#{},.T.);\n#{}=ADVANCED_FACE('',(#{0}),#{surface},.{sense}.);\n",
            n + 5,
            n + 4,
            n + 6
        );
        faces.push(format!("#{}", n + 6));
    }
    text += &format!("#33=CLOSED_SHELL('',({}));\n#34=MANIFOLD_SOLID_BREP('',#33);\n", faces.join(","));
    text + "#35=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\nENDSEC;\nEND-ISO-10303-21;\n"
}

#[test]
fn two_b_spline_faces_are_the_reliefs_of_a_block() {
    let mesh = parse(two_patches().as_bytes()).unwrap();
    let block = Block::from_mesh(&mesh).unwrap();
    let (nodes, entry) = block.entry_heights_mm().unwrap();
    assert_eq!((nodes, block.nodes(), block.size_mm()), ((5, 5), (5, 5), DVec2::new(6.0, 3.0)));
    let bernstein = |t: f64| [(1.0 - t).powi(3), 3.0 * t * (1.0 - t).powi(2), 3.0 * t * t * (1.0 - t), t.powi(3)];
    for (side, heights) in [(0, entry), (1, block.heights_mm())] {
        for (k, z) in heights.iter().enumerate() {
            let (u, v) = (bernstein((k % 5) as f64 / 4.0), bernstein((k / 5) as f64 / 4.0));
            let wanted: f64 = (0..16).map(|m| u[m / 4] * v[m % 4] * control(side, m / 4, m % 4)).sum();
            assert!((z - wanted).abs() < 1e-12, "face {side}, node {k}: {z} {wanted}");
        }
    }
}

/// Demands that a damaged file is refused with these words.
fn fails(from: &str, to: &str, words: &str) {
    let text = block();
    assert!(text.contains(from), "{from}");
    let error = parse(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
    assert!(error.contains(words), "{from} to {to}: {error}");
}

#[test]
fn a_box_of_planes_is_closed_and_in_its_unit() {
    let flat = block()
        .replace("#32=B_SPLINE", "#99=B_SPLINE")
        .replace("#31=PLANE('',#30);", "#31=PLANE('',#30);#32=PLANE('',#30);");
    for (unit, scale) in [(".MILLI.", 1.0), (".CENTI.", 10.0), ("$", 1000.0)] {
        let mesh = parse(flat.replace("SI_UNIT(.MILLI.", &format!("SI_UNIT({unit}")).as_bytes()).unwrap();
        let report = solid::check(&mesh);
        assert!(report.is_sound() && mesh.triangles.len() == 12, "{report}");
        assert!((report.volume_mm3 - 8.0 * f64::powi(scale, 3)).abs() < 1e-6);
    }
}

/// The box without its B-spline, with its solid in the representation of a context with these
/// units.
fn in_context(units: &str, of_context: &str) -> Result<f64, String> {
    let context = format!(
        "#70=(GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#79,{of_context}))REPRESENTATION_CONTEXT('',''));\n\
         #71=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#72,#34),#70);\n\
         #79=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n{units}ENDSEC;\nEND"
    );
    let text = block()
        .replace("#32=B_SPLINE", "#99=B_SPLINE")
        .replace("#31=PLANE('',#30);", "#31=PLANE('',#30);#32=PLANE('',#30);")
        .replacen("ENDSEC;\nEND", &context, 1);
    parse(text.as_bytes()).map(|mesh| (mesh.volume_mm3() / 8.0).cbrt()).map_err(|error| error.to_string())
}

#[test]
fn the_unit_is_that_of_the_solids_context() {
    let metre = "#80=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));\n";
    let inch = "#81=(CONVERSION_BASED_UNIT('INCH',#82) LENGTH_UNIT() NAMED_UNIT(#83));\n#82=LENGTH_MEASURE_WITH_UNIT(\n\
        LENGTH_MEASURE(25.4),#35);\n#83=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n";
    let micron = "#84=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MICRO.,.METRE.));\n";
    let all = [metre, inch, micron].concat();
    // The order of units in the file, and that there are others, does not matter.
    for _ in 0..8 {
        for (unit, mm) in [("#35", 1.0), ("#80", 1000.0), ("#81", 25.4), ("#84", 1e-3)] {
            let found = in_context(&all, unit).unwrap();
            assert!((found / mm - 1.0).abs() < 1e-9, "{unit}: {found}");
        }
    }
    assert!(in_context("", "#79").unwrap_err().contains("assigns no unit of length"));
    assert!(
        in_context(
            "#81=(CONVERSION_BASED_UNIT('A',#82)LENGTH_UNIT());#82=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.),#81);",
            "#81"
        )
        .unwrap_err()
        .contains("#81 is not understood")
    );
    // Without a context there must be one unit, but for those that others are defined by.
    let bare = |units: &str| {
        let text = block()
            .replace("#32=B_SPLINE", "#99=B_SPLINE")
            .replace("#31=PLANE('',#30);", &format!("#31=PLANE('',#30);#32=PLANE('',#30);{units}"));
        parse(text.as_bytes()).map(|mesh| (mesh.volume_mm3() / 8.0).cbrt()).map_err(|error| error.to_string())
    };
    assert!((bare(inch).unwrap() - 25.4).abs() < 1e-9);
    assert!(bare(metre).unwrap_err().contains("two units of length"));
}

#[test]
fn broken_files_are_named() {
    fails("ISO-10303-21;\nHEADER", "solid", "does not begin");
    fails("ENDSEC;\nEND-ISO-10303-21;\n", "", "truncated");
    fails("#34=MANIFOLD", "#34=MANYFOLD", "exactly one MANIFOLD_SOLID_BREP");
    fails("#31=PLANE", "#31=TOROIDAL_SURFACE", "TOROIDAL_SURFACE");
    fails("(LENGTH_UNIT()", "(MASS_UNIT()", "unit of length");
    fails("(#5,#8),(#6,#7)", "(#5,#8),(#6)", "different lengths");
    fails("(2,2),(2,2),(0.,1.)", "(2,2),(2,2),(1.,0.)", "knots");
    fails("1,1,((#5", "0,1,((#5", "degree");
    fails("(#106,#116", "(#9999,#116", "no entity #9999");
    fails(",(0.,1.),.UNSPECIFIED.);", ",(0.,1.),.UNSPECIFIED);", "not understood");
    fails("('',(4.0,0.0,0.))", "('',(4.0,nan,0.))", "#2");
    fails("#30,.T.);", "#30,T);", "#40 are not understood");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done to a file, it is read or refused, never a panic.
    #[test]
    fn damaged_files_are_read_or_refused(
        damage in prop::collection::vec((any::<prop::sample::Index>(), 32_u8..127), 1..20),
        keep in any::<prop::sample::Index>(),
    ) {
        let mut bytes = block().into_bytes();
        for (at, value) in damage {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        bytes.truncate(keep.index(2 * bytes.len()) + 1);
        if let Ok(mesh) = parse(&bytes) {
            prop_assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.vertices.len()));
        }
    }
}
