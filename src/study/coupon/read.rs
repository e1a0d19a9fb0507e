//! What a person with a ruler reads from the sheet: where lines stand, and how long bars are.
//!
//! Nothing here knows what was done to the coupon. The page tells a person to do what is done here,
//! with the same rules: a line or a bar ends where its light has fallen to half.

use super::piece::{Coupon, RungShows};
use glam::DVec2;
use glasswarp_verify::{Image, Window};

/// What the ladder says of the polish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Polished {
    /// No bar is as long as the marks: more than the coarsest ruling tells.
    Above {
        /// What that is, mm.
        sigma_mm: f64,
    },
    /// Some bars are longer than the marks, and the next are shorter.
    Between {
        /// The standard deviation, mm: between the two rulings in the ratio in which their bars are
        /// longer and shorter than the marks.
        sigma_mm: f64,
        /// Number of the last ruling whose bar is longer than the marks.
        last: usize,
    },
    /// Every bar is longer than the marks: what the length of the last one says, mm.
    Below {
        /// The standard deviation, mm; 0 where the bar is as long as it was made.
        sigma_mm: f64,
    },
}

impl Polished {
    /// The standard deviation that was found, mm.
    pub fn sigma_mm(&self) -> f64 {
        match *self {
            Self::Above { sigma_mm } | Self::Between { sigma_mm, .. } | Self::Below { sigma_mm } => sigma_mm,
        }
    }
}

/// The streak that scallops make of the spot at the top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Streak {
    /// Its length, mm.
    pub length_mm: f64,
    /// The direction of the rows, across it: degrees from x towards y, 0 up to 180.
    pub rows_deg: f64,
    /// The step-over that makes it, mm.
    pub step_over_mm: f64,
}

/// The lengths of bars, from outer end to outer end, and what they mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    /// Of the marks, mm.
    pub marks_mm: f64,
    /// Of the bar of every ruling, from the first, mm.
    pub bars_mm: Vec<f64>,
    /// The polish.
    pub polish: Polished,
}

/// What was read from a sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// How far apart the uprights stand, mm.
    pub uprights_mm: f64,
    /// The index that this means.
    pub ior: f64,
    /// The streak; none where the spot is hardly longer than it is wide.
    pub streak: Option<Streak>,
    /// The ladder; none where a streak lies along its bars, which it lengthens.
    pub ladder: Option<Ladder>,
}

/// A sheet on which something is missing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("on this sheet {0} cannot be found")]
pub struct Unreadable(pub &'static str);

/// How far from the middle of the sheet uprights are looked for, mm, and in what height.
const UPRIGHTS_FROM_MM: f64 = 40.0;
const UPRIGHTS_HIGH_MM: f64 = 10.0;
/// Half of the height in which a bar is looked at, mm.
const BAR_MM: f64 = 1.2;
/// How far around the spot at the top a streak is looked at, mm.
const STREAK_MM: f64 = 24.0;
/// A spot longer than this many times its width, and than the image of the lamp, is a streak.
const STREAKY: f64 = 3.0;
/// Light of a streak against its brightest place.
const BRIGHT: f64 = 0.45;

impl Reading {
    /// Reads the light of a sheet.
    ///
    /// # Errors
    /// Something that is not there.
    pub fn of(coupon: &Coupon, image: &Image, window: &Window) -> Result<Self, Unreadable> {
        let sheet = Sheet { image, window };
        let side = |sign: f64| {
            let along = sheet.along_x([-UPRIGHTS_HIGH_MM, UPRIGHTS_HIGH_MM], |x| sign * x > UPRIGHTS_FROM_MM);
            line(&along).ok_or(Unreadable("an upright"))
        };
        let uprights_mm = side(1.0)? - side(-1.0)?;
        let ior = coupon.ior_of_uprights(uprights_mm).ok_or(Unreadable("the index, by uprights this far apart,"))?;
        let streak = streak_of(coupon, &sheet, ior);
        let lengthens =
            |streak: &Streak| streak.length_mm * streak.rows_deg.to_radians().sin().abs() > coupon.plan.blur_mm();
        let ladder = if streak.as_ref().is_some_and(lengthens) { None } else { Some(Ladder::of(coupon, &sheet, ior)?) };
        Ok(Self { uprights_mm, ior, streak, ladder })
    }
}

impl Ladder {
    fn of(coupon: &Coupon, sheet: &Sheet<'_>, ior: f64) -> Result<Self, Unreadable> {
        let wide = 2.0 * coupon.reach_mm(ior);
        let (mut marks, mut bars_mm) = (Vec::new(), Vec::new());
        for rung in coupon.rungs(ior) {
            let length = || {
                let y = line(&sheet.along_y([rung.at_mm - BAR_MM, rung.at_mm + BAR_MM], 0.5 * wide))?;
                length(&sheet.along_x([y - BAR_MM, y + BAR_MM], |x| x.abs() < wide))
            };
            match rung.shows {
                RungShows::Spot => {}
                RungShows::Marks => marks.push(length().ok_or(Unreadable("a mark"))?),
                RungShows::Ruling(_) => bars_mm.push(length().ok_or(Unreadable("a bar"))?),
            }
        }
        let marks_mm = marks.iter().sum::<f64>() / marks.len() as f64;
        Ok(Self { marks_mm, polish: polish_of(coupon, marks_mm, &bars_mm), bars_mm })
    }
}

/// An image with its place.
struct Sheet<'a> {
    image: &'a Image,
    window: &'a Window,
}

impl Sheet<'_> {
    fn pixel_mm(&self) -> DVec2 {
        self.window.size_mm / DVec2::new(self.image.nx as f64, self.image.ny as f64)
    }

    /// The middle of a pixel, mm: left is +x, top is +y.
    fn place(&self, column: usize, row: usize) -> DVec2 {
        let pixel = self.pixel_mm();
        self.window.centre_mm + 0.5 * self.window.size_mm - DVec2::new(column as f64 + 0.5, row as f64 + 0.5) * pixel
    }

    fn rows(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = usize> {
        (0..self.image.ny).filter(move |&row| (low..=high).contains(&self.place(0, row).y))
    }

    /// Light along x in a band of y: places that `within` takes, ascending, and their light.
    fn along_x(&self, band: [f64; 2], within: impl Fn(f64) -> bool) -> Vec<(f64, f64)> {
        let rows: Vec<usize> = self.rows(band).collect();
        let columns = (0..self.image.nx).rev().filter(|&column| within(self.place(column, 0).x));
        let light = |column: usize| rows.iter().map(|row| self.image.values[row * self.image.nx + column]).sum();
        columns.map(|column| (self.place(column, 0).x, light(column))).collect()
    }

    /// Light along y in a band around x = 0.
    fn along_y(&self, band: [f64; 2], half_mm: f64) -> Vec<(f64, f64)> {
        let light = |row: usize| {
            let columns = (0..self.image.nx).filter(|&column| self.place(column, row).x.abs() <= half_mm);
            columns.map(|column| self.image.values[row * self.image.nx + column]).sum()
        };
        let mut along: Vec<_> = self.rows(band).map(|row| (self.place(0, row).y, light(row))).collect();
        along.reverse();
        along
    }
}

/// The middle of the brightest line: of its light where that is above half of the most.
fn line(along: &[(f64, f64)]) -> Option<f64> {
    let (peak, most) = brightest(along)?;
    let bright = |k: &usize| along[*k].1 > 0.5 * most;
    let from = (0..=peak).rev().take_while(bright).last()?;
    let to = (peak..along.len()).take_while(bright).last()?;
    let of = |f: &dyn Fn(f64) -> f64| along[from..=to].iter().map(|&(x, light)| f(x) * light).sum::<f64>();
    Some(of(&|x| x) / of(&|_| 1.0))
}

/// The length between the outermost places where light has half of what it has at the end of that
/// side, linearly between pixels.
fn length(along: &[(f64, f64)]) -> Option<f64> {
    let middle = along.len() / 2;
    let outermost = |half: &[(f64, f64)]| {
        let (_, most) = brightest(half)?;
        let k = half.iter().position(|&(_, light)| light >= 0.5 * most)?;
        let (x, light) = half[k];
        let (before, dim) = *half.get(k.checked_sub(1)?)?;
        Some(before + (x - before) * (0.5 * most - dim) / (light - dim))
    };
    let from_the_end: Vec<_> = along[middle..].iter().rev().copied().collect();
    Some(outermost(&from_the_end)? - outermost(&along[..=middle])?)
}

fn brightest(along: &[(f64, f64)]) -> Option<(usize, f64)> {
    let most = along.iter().map(|&(_, light)| light).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (most.1 > 0.0).then_some(most)
}

fn polish_of(coupon: &Coupon, marks_mm: f64, bars_mm: &[f64]) -> Polished {
    let excess: Vec<f64> = bars_mm.iter().map(|bar| bar - marks_mm).collect();
    match excess.iter().position(|&excess| excess < 0.0) {
        Some(0) => Polished::Above { sigma_mm: coupon.rulings[0].sigma_mm },
        Some(k) => {
            let part = excess[k - 1] / (excess[k - 1] - excess[k]);
            let [a, b] = [k - 1, k].map(|k| coupon.rulings[k].sigma_mm);
            Polished::Between { sigma_mm: a * (b / a).powf(part), last: k }
        }
        None => {
            let last = coupon.rulings.len() - 1;
            // Both are longer by the image of the lamp than the light of a point would be.
            let [bar, marks] = [bars_mm[last], marks_mm].map(|length| length - coupon.plan.blur_mm());
            Polished::Below { sigma_mm: coupon.rulings[last].sigma_at((bar / marks).min(2.0)) }
        }
    }
}

fn streak_of(coupon: &Coupon, sheet: &Sheet<'_>, ior: f64) -> Option<Streak> {
    let centre = DVec2::new(0.0, coupon.rungs(ior).first()?.at_mm);
    let pixel = sheet.pixel_mm();
    // The eye sees no single pixels: light is that of a millimetre around.
    let half = (DVec2::splat(0.5) / pixel).round().as_usizevec2();
    let smooth = |column: usize, row: usize| {
        let columns = column.saturating_sub(half.x)..(column + half.x + 1).min(sheet.image.nx);
        let rows = row.saturating_sub(half.y)..(row + half.y + 1).min(sheet.image.ny);
        let sum: f64 = rows
            .flat_map(|row| columns.clone().map(move |column| row * sheet.image.nx + column))
            .map(|k| sheet.image.values[k])
            .sum();
        sum / ((2 * half.x + 1) * (2 * half.y + 1)) as f64
    };
    let pixels = (0..sheet.image.nx * sheet.image.ny).map(|k| (k % sheet.image.nx, k / sheet.image.nx));
    let around: Vec<(DVec2, f64)> = pixels
        .map(|(column, row)| (sheet.place(column, row) - centre, column, row))
        .filter(|(from, ..)| from.length() < STREAK_MM)
        .map(|(from, column, row)| (from, smooth(column, row)))
        .collect();
    let most = around.iter().map(|&(_, light)| light).fold(0.0, f64::max);
    let lit: Vec<(DVec2, f64)> = around.into_iter().filter(|&(_, light)| light > BRIGHT * most).collect();
    let mean = lit.iter().map(|&(from, _)| from).sum::<DVec2>() / lit.len() as f64;
    let [xx, xy, yy] = lit.iter().fold([0.0; 3], |[xx, xy, yy], &(from, _)| {
        let d = from - mean;
        [xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y]
    });
    let along = DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy));
    let reach = |axis: DVec2| {
        let reached = lit.iter().map(|(from, _)| from.dot(axis));
        reached.clone().fold(f64::NEG_INFINITY, f64::max) - reached.fold(f64::INFINITY, f64::min)
    };
    let (long, wide) = (reach(along), reach(along.perp()));
    if long < STREAKY * wide.max(coupon.plan.blur_mm()) {
        return None;
    }
    // From end to end where the light has fallen to half of what it is in the middle.
    let step = pixel.min_element();
    let count = (2.0 * STREAK_MM / step) as usize;
    let mut profile = vec![0.0; count];
    for row in 0..sheet.image.ny {
        for column in 0..sheet.image.nx {
            let from = sheet.place(column, row) - centre - mean;
            let (u, v) = (from.dot(along), from.dot(along.perp()));
            if v.abs() <= 1.0 && u.abs() < STREAK_MM {
                profile[((u + STREAK_MM) / step) as usize % count] += sheet.image.values[row * sheet.image.nx + column];
            }
        }
    }
    let middle: Vec<f64> =
        (0..count).filter(|&k| ((k as f64 + 0.5) * step - STREAK_MM).abs() < 0.25 * long).map(|k| profile[k]).collect();
    let level = middle.iter().sum::<f64>() / middle.len() as f64;
    let first = profile.iter().position(|&light| light > 0.5 * level)?;
    let last = profile.iter().rposition(|&light| light > 0.5 * level)?;
    let length_mm = (last + 1 - first) as f64 * step;
    let step_over_mm = coupon.step_over_of_streak(length_mm, along, ior)?;
    let rows_deg = along.perp().to_angle().to_degrees().rem_euclid(180.0);
    Some(Streak { length_mm, rows_deg, step_over_mm })
}
