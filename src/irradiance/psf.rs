//! Point spread functions on the receiver: the light that arrives where a perfect block in perfect
//! light would send a single ray (section 3.3 of the paper).

use crate::grid::{Convolution, Extent, Field};
use glam::{DMat2, DVec2};

/// A point spread function on the pixels of a target: what of the light of a pixel arrives on its
/// neighbours.
///
/// Pixels are taken as what they are in a target, squares of even light: the weights are exact
/// averages over pixels of that light, blurred. They are never negative, their sum is 1, and a
/// function without width has the single weight 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Psf {
    /// Odd numbers of values, the middle one for no shift, in the frame's order.
    kernel: Field<f64>,
    pixel_mm: DVec2,
}

/// A measured point spread function: a picture of the speck that a thin beam through the block
/// makes on the receiver.
#[derive(Clone, Debug, PartialEq)]
pub struct PsfPicture {
    /// In the frame's order, sum 1, without a border of zeros.
    values: Field<f64>,
    pixel_mm: f64,
}

/// Why there is no point spread function.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PsfError {
    /// Nothing is lit.
    #[error("the picture of the point spread function is black everywhere: it must show the speck of light")]
    Black,
    /// A number that is no light.
    #[error(
        "the point spread function is {value} at column {column}, row {row}; light is finite and never negative: subtract the dark picture, and set what falls below it to 0"
    )]
    Value {
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// A number outside of what makes sense.
    #[error("{what} is {value} {unit}; it must lie between {least} and {greatest} {unit}")]
    Range {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Least accepted value.
        least: f64,
        /// Greatest accepted value.
        greatest: f64,
    },
    /// No detail of the picture could survive.
    #[error(
        "the light spreads over {:.1} x {:.1} mm of the receiver, and the picture has {:.1} x {:.1} mm: bring the receiver nearer, or take a smaller source, a smoother face or a larger window (a measured speck: crop it, and set its dark surroundings to 0)",
        size_mm.x, size_mm.y, window_mm.x, window_mm.y
    )]
    WiderThanWindow {
        /// Size of the function, mm.
        size_mm: DVec2,
        /// Size of the picture on the receiver, mm.
        window_mm: DVec2,
    },
    /// A size in the wrong unit for the light.
    #[error("the size of the source is given as {given}, but {light}")]
    SourceKind {
        /// What was given.
        given: &'static str,
        /// What the light is, and what it would take.
        light: &'static str,
    },
    /// The middle of the window gets no light whatever the face.
    #[error("no light can be sent from the middle of the block to the middle of the window")]
    Unlit,
}

/// One reason why light spreads.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Spot {
    /// A shape in units of its own, turned into millimetres on the receiver by the matrix.
    Shape(SpotShape, DMat2),
    /// A measured one.
    Picture(PsfPicture),
}

/// The shape of a spot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SpotShape {
    /// The evenly lit unit disc.
    Disc,
    /// The evenly lit square of side 1 about the origin.
    Square,
    /// Normal distribution, standard deviation 1 along every direction.
    Gaussian,
}

impl PsfPicture {
    /// Accepted sizes of a pixel, mm.
    pub const PIXEL_LIMITS_MM: (f64, f64) = (1e-5, 1e3);

    /// Takes light in the frame's order (see [`to_picture_order`](super::to_picture_order)), in any
    /// unit, on square pixels.
    ///
    /// # Errors
    /// Values that are no light, nothing but black, or a pixel size out of range.
    pub fn new(values: &Field<f64>, pixel_mm: f64) -> Result<Self, PsfError> {
        let (least, greatest) = Self::PIXEL_LIMITS_MM;
        within("the pixel of the point spread function", pixel_mm, "mm", least, greatest)?;
        let (nx, ny) = (values.nx(), values.ny());
        if let Some(k) = values.as_slice().iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err(PsfError::Value { column: k % nx, row: k / nx, value: values.as_slice()[k] });
        }
        let sum = values.mean() * (nx * ny) as f64;
        if !(sum.is_finite() && sum > 0.0) {
            return Err(PsfError::Black);
        }
        let lit = |lit: &dyn Fn(usize) -> bool, n: usize| {
            let first = (0..n).find(|&k| lit(k)).unwrap_or(0);
            first..(first..n).rfind(|&k| lit(k)).unwrap_or(first) + 1
        };
        let columns = lit(&|i| (0..ny).any(|j| values[(i, j)] > 0.0), nx);
        let rows = lit(&|j| values.row(j).iter().any(|v| *v > 0.0), ny);
        let values =
            Field::from_fn(columns.len(), rows.len(), |i, j| values[(columns.start + i, rows.start + j)] / sum);
        Ok(Self { values, pixel_mm })
    }

    /// Its middle by weight, in pixels from its corner.
    fn centroid(&self) -> DVec2 {
        let mut sum = DVec2::ZERO;
        for j in 0..self.values.ny() {
            for (i, value) in self.values.row(j).iter().enumerate() {
                sum += *value * DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
            }
        }
        sum
    }
}

/// Refuses a number out of range.
pub(crate) fn within(
    what: &'static str,
    value: f64,
    unit: &'static str,
    least: f64,
    greatest: f64,
) -> Result<(), PsfError> {
    if (least..=greatest).contains(&value) {
        Ok(())
    } else {
        Err(PsfError::Range { what, value, unit, least, greatest })
    }
}

/// A normal distribution is cut off at so many standard deviations, beyond which 4e-5 of it lie.
const GAUSSIAN_REACH: f64 = 4.5;
/// Points of a shape for each step of the lattice that it is drawn on.
const POINTS_PER_STEP: f64 = 4.0;
/// Points across a shape, at least and at most.
const POINTS: (f64, f64) = (256.0, 1024.0);
/// Steps of the lattice on which several shapes are convolved, in a pixel; odd, so that both have
/// their middle in common.
const FINE_STEPS: usize = 5;
/// Most steps from the middle of that lattice; coarser steps are taken beyond.
const MOST_FINE_STEPS: f64 = 1024.0;

impl Psf {
    /// The function of perfect light.
    pub fn identity(pixel_mm: DVec2) -> Self {
        Self { kernel: Field::filled(1, 1, 1.0), pixel_mm }
    }

    /// A measured function on `cells` of a window.
    ///
    /// # Errors
    /// [`PsfError::WiderThanWindow`].
    pub fn of_picture(picture: PsfPicture, window: Extent, cells: (usize, usize)) -> Result<Self, PsfError> {
        Self::of_spots(&[Spot::Picture(picture)], window, cells)
    }

    /// All spots, one after the other (each spreads the light of the others), on `cells` of a
    /// window.
    ///
    /// Models are centred, and pictures are put with their middle by weight onto the middle.
    ///
    /// # Errors
    /// [`PsfError::WiderThanWindow`].
    pub(crate) fn of_spots(spots: &[Spot], window: Extent, cells: (usize, usize)) -> Result<Self, PsfError> {
        let pixel_mm = window.as_vec() / DVec2::new(cells.0 as f64, cells.1 as f64);
        let reach: DVec2 = spots.iter().map(Spot::reach_mm).sum();
        if (2.0 * reach).cmpgt(window.as_vec()).any() {
            return Err(PsfError::WiderThanWindow { size_mm: 2.0 * reach, window_mm: window.as_vec() });
        }
        let kernel = match spots {
            [] => return Ok(Self::identity(pixel_mm)),
            [one] => one.on_lattice(pixel_mm),
            several => {
                let furthest = (reach / pixel_mm).max_element() * FINE_STEPS as f64;
                let steps = if furthest <= MOST_FINE_STEPS { FINE_STEPS } else { 1 };
                let fine_mm = pixel_mm / steps as f64;
                let drawn: Vec<Field<f64>> = several.iter().map(|spot| spot.on_lattice(fine_mm)).collect();
                gathered(&convolved(&drawn), steps)
            }
        };
        Ok(Self { kernel: normalised(kernel), pixel_mm })
    }

    /// The weights: odd numbers of them, the middle one for no shift, in the frame's order.
    pub fn kernel(&self) -> &Field<f64> {
        &self.kernel
    }

    /// Standard deviations along x and y, mm.
    pub fn deviation_mm(&self) -> DVec2 {
        let (rx, ry) = (self.kernel.nx() / 2, self.kernel.ny() / 2);
        let (mut mean, mut square) = (DVec2::ZERO, DVec2::ZERO);
        for j in 0..self.kernel.ny() {
            for (i, weight) in self.kernel.row(j).iter().enumerate() {
                let at = DVec2::new(i as f64 - rx as f64, j as f64 - ry as f64);
                mean += *weight * at;
                square += *weight * at * at;
            }
        }
        let variance = (square - mean * mean).max(DVec2::ZERO);
        DVec2::new(variance.x.sqrt(), variance.y.sqrt()) * self.pixel_mm
    }

    /// What becomes of light on a window of cells if all beyond it is dark.
    pub fn blurred(&self, cells: &Field<f64>) -> Field<f64> {
        let mut out = Field::filled(cells.nx(), cells.ny(), 0.0);
        Convolution::new(&self.kernel, cells.nx(), cells.ny()).apply(cells, &mut out);
        // Rounding of the transforms.
        out.as_mut_slice().iter_mut().for_each(|v| *v = v.max(0.0));
        out
    }
}

impl SpotShape {
    /// Its radius, or half its side, in its own units.
    fn reach(self) -> f64 {
        match self {
            Self::Disc => 1.0,
            Self::Square => 0.5,
            Self::Gaussian => GAUSSIAN_REACH,
        }
    }

    /// Its light, in any unit.
    fn light(self, at: DVec2) -> f64 {
        match self {
            Self::Disc | Self::Gaussian if at.length() > self.reach() => 0.0,
            Self::Disc | Self::Square => 1.0,
            Self::Gaussian => (-0.5 * at.length_squared()).exp(),
        }
    }
}

impl Spot {
    /// Half of the size of the rectangle about its middle that holds it, mm.
    fn reach_mm(&self) -> DVec2 {
        match self {
            Self::Shape(SpotShape::Square, map) => {
                0.5 * DVec2::new(map.row(0).abs().element_sum(), map.row(1).abs().element_sum())
            }
            Self::Shape(round, map) => round.reach() * DVec2::new(map.row(0).length(), map.row(1).length()),
            Self::Picture(picture) => {
                let centre = picture.centroid();
                let size = DVec2::new(picture.values.nx() as f64, picture.values.ny() as f64);
                picture.pixel_mm * centre.max(size - centre)
            }
        }
    }

    /// Weights on the points of a lattice of this step, each the spot's light times the hat
    /// function of the point: the exact average over a cell of the blurred light of its neighbours,
    /// if that light is even in every cell.
    fn on_lattice(&self, step_mm: DVec2) -> Field<f64> {
        let reach = self.reach_mm() / step_mm;
        let middle = (reach.x.floor() as usize + 1, reach.y.floor() as usize + 1);
        let mut lattice = Field::filled(2 * middle.0 + 1, 2 * middle.1 + 1, 0.0);
        match self {
            Self::Shape(shape, map) => {
                let to_lattice = DMat2::from_diagonal(1.0 / step_mm) * *map;
                draw_shape(&mut lattice, *shape, to_lattice, reach.max_element());
            }
            Self::Picture(picture) => draw_picture(&mut lattice, picture, picture.pixel_mm / step_mm),
        }
        normalised(lattice)
    }
}

/// Spreads points of equal area over a shape, each over the four points of the lattice around it.
fn draw_shape(lattice: &mut Field<f64>, shape: SpotShape, to_lattice: DMat2, reach: f64) {
    let middle = DVec2::new((lattice.nx() / 2) as f64, (lattice.ny() / 2) as f64);
    let points = (2.0 * POINTS_PER_STEP * reach).clamp(POINTS.0, POINTS.1).ceil();
    for q in 0..points as usize {
        for p in 0..points as usize {
            let place = shape.reach() * (2.0 * (DVec2::new(p as f64, q as f64) + 0.5) / points - 1.0);
            let light = shape.light(place);
            if light == 0.0 {
                continue;
            }
            let at = to_lattice * place + middle;
            let (i, j) = (at.x as usize, at.y as usize);
            let (s, t) = (at.x - i as f64, at.y - j as f64);
            lattice[(i, j)] += light * (1.0 - s) * (1.0 - t);
            lattice[(i + 1, j)] += light * s * (1.0 - t);
            lattice[(i, j + 1)] += light * (1.0 - s) * t;
            lattice[(i + 1, j + 1)] += light * s * t;
        }
    }
}

/// Averages the hat function of every point of the lattice over every pixel; `scale` is a pixel in
/// steps of the lattice.
fn draw_picture(lattice: &mut Field<f64>, picture: &PsfPicture, scale: DVec2) {
    let values = &picture.values;
    let overlaps = |pixels: usize, points: usize, centre: f64, scale: f64| {
        let edge = |k: usize, i: usize| (k as f64 - centre) * scale + (points / 2) as f64 - i as f64;
        Field::from_fn(points, pixels, |i, k| mean_of_hat(edge(k, i), edge(k + 1, i)))
    };
    let centre = picture.centroid();
    let along_x = overlaps(values.nx(), lattice.nx(), centre.x, scale.x);
    let along_y = overlaps(values.ny(), lattice.ny(), centre.y, scale.y);
    let mut sums = vec![0.0; lattice.nx()];
    for q in 0..values.ny() {
        sums.fill(0.0);
        for (p, light) in values.row(q).iter().enumerate().filter(|(_, light)| **light > 0.0) {
            sums.iter_mut().zip(along_x.row(p)).for_each(|(sum, overlap)| *sum += light * overlap);
        }
        for (j, overlap) in along_y.row(q).iter().enumerate().filter(|(_, overlap)| **overlap > 0.0) {
            for (i, sum) in sums.iter().enumerate() {
                lattice[(i, j)] += overlap * sum;
            }
        }
    }
}

/// Mean over the interval of the hat function, which is 1 at 0 and 0 from -1 and 1 on.
fn mean_of_hat(from: f64, to: f64) -> f64 {
    // Below this width the difference of integrals is nothing but rounding.
    const NARROW: f64 = 1e-7;
    let integral = |x: f64| {
        let x = x.clamp(-1.0, 1.0);
        if x < 0.0 { 0.5 * (1.0 + x) * (1.0 + x) } else { 1.0 - 0.5 * (1.0 - x) * (1.0 - x) }
    };
    if to - from < NARROW {
        (1.0 - (0.5 * (from + to)).abs()).max(0.0)
    } else {
        (integral(to) - integral(from)) / (to - from)
    }
}

/// All of them, convolved with each other.
fn convolved(parts: &[Field<f64>]) -> Field<f64> {
    let side = |size: &dyn Fn(&Field<f64>) -> usize| 1 + parts.iter().map(|part| size(part) - 1).sum::<usize>();
    let (nx, ny) = (side(&Field::nx), side(&Field::ny));
    let mut sum = Field::filled(nx, ny, 0.0);
    sum[(nx / 2, ny / 2)] = 1.0;
    for part in parts {
        let before = sum.clone();
        Convolution::new(part, nx, ny).apply(&before, &mut sum);
        // Rounding of the transforms.
        sum.as_mut_slice().iter_mut().for_each(|v| *v = v.max(0.0));
    }
    sum
}

/// A lattice of `steps` steps to a pixel, an odd number, gathered on the pixels by their hat
/// functions.
fn gathered(fine: &Field<f64>, steps: usize) -> Field<f64> {
    if steps == 1 {
        return fine.clone();
    }
    let reach = |n: usize| (n / 2).div_ceil(steps);
    let (rx, ry) = (reach(fine.nx()), reach(fine.ny()));
    let mut pixels = Field::filled(2 * rx + 1, 2 * ry + 1, 0.0);
    let place = |k: usize, n: usize, r: usize| {
        let at = (k as f64 - (n / 2) as f64) / steps as f64 + r as f64;
        let first = (at as usize).min(2 * r - 1);
        (first, at - first as f64)
    };
    for k in 0..fine.ny() {
        let (j, t) = place(k, fine.ny(), ry);
        for (l, weight) in fine.row(k).iter().enumerate() {
            let (i, s) = place(l, fine.nx(), rx);
            pixels[(i, j)] += weight * (1.0 - s) * (1.0 - t);
            pixels[(i + 1, j)] += weight * s * (1.0 - t);
            pixels[(i, j + 1)] += weight * (1.0 - s) * t;
            pixels[(i + 1, j + 1)] += weight * s * t;
        }
    }
    pixels
}

/// With the sum 1.
fn normalised(weights: Field<f64>) -> Field<f64> {
    let sum = weights.mean() * (weights.nx() * weights.ny()) as f64;
    weights.map(|v| v / sum)
}

#[cfg(test)]
mod tests;
