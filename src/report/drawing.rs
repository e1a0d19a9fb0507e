//! The block as a workshop draws it: seen from above and cut in the middle, with its dimensions,
//! its axes and its origin.

use super::{
    dimension::{Beside, dimension},
    svg::{Anchor, Lettering, Pen, Svg, arrow, ring},
};
use crate::{
    bench::{Bench, ExitFace},
    grid::Outline,
    light::Light,
    solid::Solid,
};
use glam::{DVec2, DVec3};

/// Longer side of the view from above, pixels.
const PLAN: f64 = 620.0;
/// Space around a view for its dimensions, pixels.
const MARGIN: f64 = 130.0;
/// Space for the lines of text on the right, pixels.
const NOTES: f64 = 560.0;
/// Height of the section, pixels, that heights are stretched to, in whole steps.
const SECTION: f64 = 120.0;
/// Greatest stretch of heights.
const MOST_STRETCH: f64 = 20.0;
const TEXT: Lettering = Lettering { height: 14.0, grey: 20, halo: 2.0 };
const NOTE: Lettering = Lettering { height: 11.0, grey: 20, halo: 0.0 };
const OUTLINE: Pen = Pen { width: 2.2, grey: 0 };
const DIMENSION: Pen = Pen { width: 1.0, grey: 110 };
const AXIS: Pen = Pen { width: 1.4, grey: 0 };
const RAY: Pen = Pen { width: 1.4, grey: 110 };
/// From a view to its dimension lines, pixels.
const AWAY: f64 = 60.0;
/// Length of an arrow's head, pixels.
const HEAD: f64 = 11.0;

/// A block as a workshop draws it, in the coordinates of its files, mm, with its light and the way
/// to its receiver.
///
/// The view from above has `+x` to the right and `+y` up, as CAM programs show it. The section lies
/// in the plane `y = 0` of the bench, or in `x = 0` if the light is tilted more in that one, with
/// heights stretched as it says.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// The view from above and the section.
    pub views: Svg,
    /// What is written beside them, in lines; an empty one parts them.
    pub notes: Vec<String>,
    /// From the left of the views to the notes, and down to the first, pixels.
    beside: DVec2,
}

impl Drawing {
    /// Draws a block. `order` is what to order, in lines.
    pub fn of(solid: &Solid, bench: &Bench, order: &[String]) -> Self {
        let stock = solid.stock_extent();
        let scale = PLAN / stock.width_mm.max(stock.height_mm);
        let stretch = (SECTION / (scale * solid.thickness_mm())).clamp(1.0, MOST_STRETCH).floor();
        let tall = scale * stretch * solid.thickness_mm();
        let size = DVec2::new(scale * stock.width_mm, scale * stock.height_mm);
        let cut = Cut::of(bench);
        let length = cut.along(size).max(size.x);
        let mut views = Svg::new((length + 2.0 * MARGIN) as u32, (size.y + tall + 3.0 * MARGIN) as u32);
        let centre = DVec2::new(MARGIN, MARGIN) + 0.5 * size;
        Plan { solid, bench, scale, centre }.draw(&mut views);
        let bottom = size.y + 2.0 * MARGIN + tall;
        Section { solid, bench, cut, scale, stretch, left: MARGIN, bottom }.draw(&mut views);
        let notes = notes(solid, bench, order, stretch);
        Self { views, notes, beside: DVec2::new(length + 2.0 * MARGIN, MARGIN) }
    }

    /// Both on one sheet.
    pub fn sheet(&self) -> Svg {
        let (width, height) = self.views.size();
        let mut sheet = Svg::new(width + NOTES as u32, height);
        sheet.inset(0, 0, self.views.clone());
        for (k, note) in self.notes.iter().enumerate() {
            let at = self.beside + DVec2::new(0.0, 26.0 * k as f64);
            sheet.fitted_text(at, Anchor::Start, note, NOTE, NOTES);
        }
        sheet
    }
}

/// A [`Drawing`] with its notes, on one sheet.
pub fn dimensioned_drawing(solid: &Solid, bench: &Bench, order: &[String]) -> Svg {
    Drawing::of(solid, bench, order).sheet()
}

/// The plane of the section: that in which light is tilted more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cut {
    /// Along x, at y = 0.
    X,
    /// Along y, at x = 0.
    Y,
}

impl Cut {
    fn of(bench: &Bench) -> Self {
        match bench.light() {
            Light::Parallel { .. } => {
                let light = bench.light_in_air();
                // A rounding is no tilt.
                if light.y.abs() > light.x.abs() + 1e-9 { Self::Y } else { Self::X }
            }
            Light::Point { .. } => Self::X,
        }
    }

    /// What lies along the section of something in the plane of the face.
    fn along(self, at: DVec2) -> f64 {
        match self {
            Self::X => at.x,
            Self::Y => at.y,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::X => "section at y = 0, +x to the right",
            Self::Y => "section at x = 0, +y to the right",
        }
    }
}

/// A length without the digits that only rounding errors fill.
fn mm(value: f64) -> String {
    format!("{}", (value * 1000.0).round() / 1000.0 + 0.0)
}

fn notes(solid: &Solid, bench: &Bench, order: &[String], stretch: f64) -> Vec<String> {
    let (face, stock, origin) = (solid.extent(), solid.stock_extent(), solid.origin_mm());
    let (low, high) = solid.surface().range_mm();
    let z = |of_bench: f64| mm(of_bench - origin.z);
    let mut notes = vec![
        "all lengths in mm; seen from above the face".to_owned(),
        format!("block {} × {} × {}", mm(stock.width_mm), mm(stock.height_mm), mm(solid.thickness_mm())),
        format!("exit face {} × {}, relief {}", mm(face.width_mm), mm(face.height_mm), mm(high - low)),
        format!("thinnest place {}", mm(solid.thinnest_mm())),
        String::new(),
        format!("origin: {}", solid.shape().origin.name()),
        format!("  {}", solid.shape().origin.place()),
        format!("entry face at z = {}", z(solid.entry_z_mm())),
        format!("lowest place of the exit face z = {}", z(low)),
        format!("mean exit plane z = {}", z(0.0)),
        format!("highest place of the exit face z = {}", z(high)),
    ];
    notes.splice(1..1, order.iter().cloned());
    if let (Some(rim), Some(plane)) = (solid.shape().rim, solid.rim_z_mm()) {
        notes.push(format!("rim {} wide, plane at z = {}", mm(rim.width_mm), z(plane)));
        if let Some(mark) = rim.mark_mm {
            notes.push(match solid.contour() {
                None => format!("mark: {} cut off the corner +x +y", mm(mark)),
                Some(_) => format!("mark: a flat {} deep towards +x +y", mm(mark * std::f64::consts::FRAC_1_SQRT_2)),
            });
        }
    }
    match solid.surface().outline() {
        Outline::Rectangle => {}
        Outline::Circle if face.width_mm == face.height_mm => {
            notes.push(format!("round, diameter {}", mm(face.width_mm)));
        }
        Outline::Circle => notes.push("the outline is an ellipse".to_owned()),
        Outline::Rounded { radius_mm } => notes.push(format!("corners rounded, radius {}", mm(radius_mm))),
    }
    let distance_mm = bench.distance_mm();
    notes.push(format!("receiver at z = {}: {} from the mean exit plane", z(distance_mm), mm(distance_mm)));
    if bench.receiver().is_turned() {
        notes.push(format!("  it leans: its normal is {}", vector(bench.receiver().axes().z_axis)));
    }
    notes.push(String::new());
    notes.extend(light_notes(bench, origin));
    notes.extend([
        "seen on the wall from the block's side:".to_owned(),
        "  the picture's left is +x, its top is +y".to_owned(),
        format!("section through the axis, heights {stretch} × enlarged"),
    ]);
    notes
}

/// Where light comes from, in the coordinates of the files.
fn light_notes(bench: &Bench, origin: DVec3) -> Vec<String> {
    let onto = match bench.exit_face() {
        ExitFace::Refracts { .. } => "into the flat entry face",
        ExitFace::Reflects => "onto the exit face, which is a mirror",
    };
    let onto = if bench.known_faces().is_empty() { onto } else { "through other blocks into the flat entry face" };
    match bench.light() {
        Light::Parallel { .. } if bench.light_in_air() == DVec3::Z => vec![format!("light goes along +z, {onto}")],
        Light::Parallel { .. } => {
            vec![format!("light goes along {},", vector(bench.light_in_air())), format!("  {onto}")]
        }
        Light::Point { position_mm, .. } => {
            let [x, y, z] = (position_mm - origin).to_array().map(mm);
            vec![format!("light from the point ({x}, {y}, {z}),"), format!("  {onto}")]
        }
    }
}

/// How far parallel light is off the axis, in words.
fn tilt(bench: &Bench) -> String {
    let light = bench.light_in_air();
    let degrees = light.truncate().length().atan2(light.z.abs()).to_degrees();
    format!("{}° to the axis", (degrees * 100.0).round() / 100.0 + 0.0)
}

/// A direction to four digits.
fn vector(direction: DVec3) -> String {
    let [x, y, z] = direction.to_array().map(|v| (v * 1e4).round() / 1e4 + 0.0);
    format!("({x}, {y}, {z})")
}

/// The view from above.
struct Plan<'a> {
    solid: &'a Solid,
    bench: &'a Bench,
    scale: f64,
    centre: DVec2,
}

impl Plan<'_> {
    /// A point of the bench on the picture.
    fn at(&self, point: DVec2) -> DVec2 {
        self.centre + self.scale * DVec2::new(point.x, -point.y)
    }

    fn draw(&self, image: &mut Svg) {
        let (face, stock) = (0.5 * self.solid.extent().as_vec(), 0.5 * self.solid.stock_extent().as_vec());
        image.stroke(&ring(self.solid.outline().iter().map(|&p| self.at(p))), OUTLINE);
        if self.solid.shape().rim.is_some() {
            let inner = self.solid.surface().contour().polygon(1e-3 * face.max_element());
            image.stroke(&ring(inner.iter().map(|&p| self.at(p))), OUTLINE);
            let [left, corner, below] =
                [DVec2::new(-face.x, face.y), face, DVec2::new(face.x, -face.y)].map(|p| self.at(p));
            let out = self.at(stock) + DVec2::new(AWAY, -AWAY);
            dimension(image, [left, corner], Beside::Level(out.y), &mm(2.0 * face.x), TEXT);
            dimension(image, [corner, below], Beside::Upright(out.x), &mm(2.0 * face.y), TEXT);
        }
        let [upper, lower, right] =
            [DVec2::new(-stock.x, stock.y), -stock, DVec2::new(stock.x, -stock.y)].map(|p| self.at(p));
        dimension(image, [lower, right], Beside::Level(lower.y + AWAY), &mm(2.0 * stock.x), TEXT);
        dimension(image, [upper, lower], Beside::Upright(lower.x - AWAY), &mm(2.0 * stock.y), TEXT);
        image.text(DVec2::new(self.centre.x, 22.0), Anchor::Middle, "seen from above the exit face", TEXT);
        let corner = self.at(face) + DVec2::new(-96.0, 22.0);
        image.text(corner, Anchor::Middle, "picture's top left", TEXT);
        self.origin(image);
        self.light(image);
    }

    /// Which way tilted light goes, seen from above.
    fn light(&self, image: &mut Svg) {
        let direction = self.bench.light_in_air();
        let across = DVec2::new(direction.x, -direction.y);
        if !matches!(self.bench.light(), Light::Parallel { .. }) || across.length() < 1e-9 {
            return;
        }
        let along = across.normalize();
        let from = self.centre - 0.34 * PLAN.min(2.0 * (self.centre.min_element() - MARGIN)) * along;
        image.stroke(&arrow(from - 60.0 * along, from, HEAD), RAY);
        let beside = from - 30.0 * along + DVec2::new(14.0, 4.0);
        image.text(beside, Anchor::Start, "light goes this way,", TEXT);
        image.text(beside + DVec2::new(0.0, 24.0), Anchor::Start, &tilt(self.bench), TEXT);
    }

    /// The origin of the files and its axes.
    fn origin(&self, image: &mut Svg) {
        let origin = self.at(self.solid.origin_mm().truncate());
        for (direction, name) in [(DVec2::new(1.0, 0.0), "x"), (DVec2::new(0.0, -1.0), "y")] {
            image.stroke(&arrow(origin, origin + 70.0 * direction, HEAD), AXIS);
            image.text(origin + 86.0 * direction, Anchor::Middle, name, TEXT);
        }
        image.circle(origin, 7.0, Pen { width: 1.8, grey: 0 });
        image.text(origin + DVec2::new(34.0, 18.0), Anchor::Middle, "origin", TEXT);
    }
}

/// The section through the middle of the block.
struct Section<'a> {
    solid: &'a Solid,
    bench: &'a Bench,
    cut: Cut,
    scale: f64,
    stretch: f64,
    left: f64,
    bottom: f64,
}

impl Section<'_> {
    /// A point of the bench, by its place along the section and z, on the picture.
    fn at(&self, along: f64, z: f64) -> DVec2 {
        let from_left = along + 0.5 * self.cut.along(self.solid.stock_extent().as_vec());
        let above = self.stretch * (z - self.solid.entry_z_mm());
        DVec2::new(self.left + self.scale * from_left, self.bottom - self.scale * above)
    }

    fn draw(&self, image: &mut Svg) {
        let (face, stock) = (self.solid.extent(), self.solid.stock_extent());
        let heights = self.solid.surface().heights_mm();
        let (nx, ny) = (heights.nx(), heights.ny());
        let (face, stock) = (self.cut.along(face.as_vec()), self.cut.along(stock.as_vec()));
        let n = if self.cut == Cut::X { nx } else { ny };
        let height = |k: usize| heights[if self.cut == Cut::X { (k, ny / 2) } else { (nx / 2, k) }];
        let (entry, half) = (self.solid.entry_z_mm(), 0.5 * stock);
        let mut profile: Vec<DVec2> =
            (0..n).map(|k| self.at(face * (k as f64 / (n - 1) as f64 - 0.5), height(k))).collect();
        let top = entry + self.solid.thickness_mm();
        let edge = self.solid.rim_z_mm();
        if let Some(rim_z) = edge {
            let inner = 0.5 * face;
            profile.splice(0..0, [self.at(-half, rim_z), self.at(-inner, rim_z)]);
            profile.extend([self.at(inner, rim_z), self.at(half, rim_z)]);
        }
        profile.extend([self.at(half, entry), self.at(-half, entry)]);
        image.stroke(&ring(profile), OUTLINE);
        let beyond = DVec2::new(20.0, 0.0);
        image.dashed(self.at(-half, 0.0) - beyond, self.at(half, 0.0) + beyond, DIMENSION);
        for (line, down) in [("mean exit", -10.0), ("plane", 10.0)] {
            image.text(self.at(half, 0.0) + DVec2::new(26.0, down), Anchor::Start, line, NOTE);
        }
        let thickness = mm(self.solid.thickness_mm());
        let sides = [self.at(-half, top), self.at(-half, entry)];
        dimension(image, sides, Beside::Upright(sides[0].x - AWAY), &thickness, TEXT);
        for k in 0..5 {
            let t = half * (0.4 * f64::from(k) - 0.8);
            let (z, direction) = self.light_at(t, entry, top);
            // At its true angle: only heights are stretched.
            let along = DVec2::new(self.cut.along(direction.truncate()), -direction.z).normalize_or(DVec2::NEG_Y);
            let foot = self.at(t, z);
            image.stroke(&arrow(foot - 48.0 * along, foot - 8.0 * along, HEAD), RAY);
        }
        if let ExitFace::Refracts { .. } = self.bench.exit_face() {
            let tilted = matches!(self.bench.light(), Light::Parallel { .. }) && self.bench.light_in_air() != DVec3::Z;
            let light = if tilted { format!("light, {}", tilt(self.bench)) } else { "light".to_owned() };
            image.text(self.at(0.0, entry) + DVec2::new(0.0, 70.0), Anchor::Middle, &light, TEXT);
        }
        image.text(self.at(0.0, entry) + DVec2::new(0.0, 98.0), Anchor::Middle, self.cut.name(), TEXT);
        let origin = self.solid.origin_mm();
        let at = self.at(self.cut.along(origin.truncate()), origin.z);
        let pen = Pen { width: 2.4, grey: 0 };
        image.line(at - DVec2::new(9.0, 0.0), at + DVec2::new(9.0, 0.0), pen);
        image.line(at - DVec2::new(0.0, 9.0), at + DVec2::new(0.0, 9.0), pen);
        image.text(at + DVec2::new(34.0, -16.0), Anchor::Middle, "origin", TEXT);
    }

    /// Where light that comes to a place along the section is shown to arrive, and along which
    /// direction in air.
    fn light_at(&self, along: f64, entry_z: f64, top_z: f64) -> (f64, DVec3) {
        let z = match self.bench.exit_face() {
            ExitFace::Refracts { .. } => entry_z,
            ExitFace::Reflects => top_z,
        };
        let direction = match self.bench.light() {
            Light::Parallel { .. } => self.bench.light_in_air(),
            Light::Point { position_mm, .. } => {
                let at = if self.cut == Cut::X { DVec2::new(along, 0.0) } else { DVec2::new(0.0, along) };
                at.extend(z) - position_mm
            }
        };
        (z, direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{Extent, Field},
        light::Intensity,
        solid::{Origin, Rim, Shape, Stock},
        surface::HeightField,
    };

    fn glass() -> Bench {
        Bench::new(Extent::new(60.0, 40.0), 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap()
    }

    fn solid(shape: Shape) -> Solid {
        let surface = HeightField::new(Extent::new(60.0, 40.0), Field::from_fn(13, 9, |i, j| 0.02 * (i * j) as f64));
        Solid::shaped(&surface, Stock::of_thickness(12.0), shape).unwrap()
    }

    #[test]
    fn the_notes_name_units_sizes_and_heights_from_the_origin() {
        let rim = Some(Rim { width_mm: 5.0, rise_mm: -4.0, mark_mm: Some(3.0) });
        let solid = solid(Shape { rim, origin: Origin::Corner, ..Shape::default() });
        let notes = notes(&solid, &glass(), &["order: a sheet".to_owned()], 3.0).join("\n");
        let mean = -solid.entry_z_mm();
        for part in [
            "all lengths in mm",
            "\norder: a sheet\n",
            "block 70 × 50 × 12",
            "exit face 60 × 40",
            "origin: corner",
            "entry face at z = 0\n",
            "plane at z = 8",
            "3 cut off the corner",
            &format!("mean exit plane z = {}", mm(mean)),
            &format!("receiver at z = {}", mm(mean + 250.0)),
            "light goes along +z, into the flat entry face",
        ] {
            assert!(notes.contains(part), "{part} is not in\n{notes}");
        }
    }

    #[test]
    fn the_notes_say_where_light_comes_from_on_any_bench() {
        let solid = solid(Shape { origin: Origin::Entry, ..Shape::default() });
        let said = |bench: Bench| notes(&solid, &bench, &[], 3.0).join("\n");
        let mirror = Bench::new(solid.extent(), 250.0, ExitFace::Reflects).unwrap();
        let tilted = mirror.with_light_in_air(DVec3::new(0.0, -0.5, -(0.75_f64.sqrt()))).unwrap();
        let says = said(tilted);
        assert!(
            says.contains("light goes along (0, -0.5, -0.866),\n  onto the exit face, which is a mirror"),
            "{says}"
        );
        let entry = solid.entry_z_mm();
        let lamp = DVec3::new(3.0, 0.0, entry - 100.0);
        let lit = glass().with_point_source(lamp, -entry, Intensity::Isotropic).unwrap();
        let says = said(lit.with_receiver_turned(DVec3::new(0.3, 0.0, 0.0)).unwrap());
        assert!(says.contains("light from the point (3, 0, -100),") && says.contains("it leans"), "{says}");
    }

    #[test]
    fn the_section_lies_where_the_light_is_tilted_and_its_arrows_follow() {
        let along = |x: f64, y: f64| {
            let light = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
            glass().with_light_in_air(light).unwrap()
        };
        for (bench, cut) in [(glass(), Cut::X), (along(0.3, 0.1), Cut::X), (along(0.1, -0.3), Cut::Y)] {
            assert_eq!(Cut::of(&bench), cut);
            let solid = solid(Shape::default());
            let drawing = Drawing::of(&solid, &bench, &[]);
            let section =
                Section { solid: &solid, bench: &bench, cut, scale: 1.0, stretch: 1.0, left: 0.0, bottom: 0.0 };
            let (_, direction) = section.light_at(0.0, solid.entry_z_mm(), 0.0);
            assert!((direction - bench.light_in_air()).length() < 1e-12);
            let words = drawing.views.element("");
            let tilted = bench.light_in_air() != DVec3::Z;
            assert_eq!(words.matches("18.43° to the axis").count(), if tilted { 2 } else { 0 }, "{words}");
            assert_eq!(words.contains(Cut::Y.name()), cut == Cut::Y);
        }
        // The profile is that of the plane of the section: this face rises along y alone.
        let ridge = HeightField::new(Extent::new(60.0, 40.0), Field::from_fn(13, 9, |_, j| 0.3 * j as f64));
        let ridge = Solid::shaped(&ridge, Stock::of_thickness(12.0), Shape::default()).unwrap();
        let scale = PLAN / 60.0;
        let rise_px = |bench: &Bench, length_mm: f64| {
            let image = Drawing::of(&ridge, bench, &[]).views.raster();
            let top = |part: f64| {
                let x = (MARGIN + part * scale * length_mm) as u32;
                let begin = (MARGIN + 40.0 * scale + 20.0) as u32;
                (begin..image.height()).find(|&y| image.get_pixel(x, y).0[0] < 40).unwrap()
            };
            f64::from(top(0.1)) - f64::from(top(0.9))
        };
        assert!(rise_px(&glass(), 60.0).abs() <= 1.0);
        assert!((rise_px(&along(0.0, 0.3), 40.0) - 0.8 * 2.4 * scale).abs() <= 1.5);
    }

    #[test]
    fn the_outline_is_drawn_where_the_block_is() {
        let image = dimensioned_drawing(&solid(Shape::default()), &glass(), &[]).raster();
        let dark = |x: f64, y: f64| image.get_pixel(x as u32, y as u32).0[0] < 100;
        let (width, height) = (PLAN, PLAN * 40.0 / 60.0);
        // Left, right, upper and lower edge at a quarter of their length, where nothing else is.
        assert!(dark(MARGIN, MARGIN + 0.25 * height) && dark(MARGIN + width, MARGIN + 0.75 * height));
        assert!(dark(MARGIN + 0.25 * width, MARGIN) && dark(MARGIN + 0.25 * width, MARGIN + height));
        assert!(!dark(MARGIN + 0.25 * width, MARGIN + 0.25 * height));
    }
}
