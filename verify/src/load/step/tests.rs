use super::*;
use crate::solid;
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
