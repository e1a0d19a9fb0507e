//! Everything that a maker and a shop must know before a slab is paid for, asked at once: whether
//! the block can be made, what the finished face draws in the real light, and what faults of the
//! bench do to it.

use super::{
    check::{CheckStudy, FaceForm, Makeable, Shop},
    design::shape,
    face::with_face,
    imperfect::{ImperfectView, blurred, if_it_is_the_sun, spread_in_words},
    judge::Subject,
    mill::{MillStudy, figures},
    order::StockOrder,
    progress::{advance, begin},
    requirements::psf_of,
    tolerance::{self, ToleranceCase, Tolerances},
    verdict::{Answer, Verdict, seen_in_words},
    workpiece::{JudgedImage, Workpiece},
};
use crate::{
    fabricate::{Direction, Pass},
    failure::Failure,
    irradiance::Psf,
    record::SideFile,
    solid::{Shape, Solid, Stock},
    solver::Progress,
    spec::{Host, Settings, SourceName},
    surface::Polish,
};
use glasswarp_verify::{
    Geometry, Image, PhotonPlan, Surface,
    metrics::{self, Likeness},
    reference::resampled,
};

/// What is asked.
pub struct Question {
    /// Cutter, rows, polish, and what the shop can do.
    pub shop: Shop,
    /// Of the rows.
    pub direction: Direction,
    /// The size of the light, if it is not that of the design.
    pub source: Option<SourceName>,
    /// By how much things may be off.
    pub tolerances: Tolerances,
}

impl Question {
    /// What is asked where nobody says more: a pass and the polish after it, in a shop as it usually is, on
    /// a bench that is off as benches usually are.
    pub fn of(pass: Pass, polish: Polish, side: &SideFile) -> Self {
        Self {
            shop: Shop {
                cutter: pass.cutter,
                step_over_mm: pass.step_over_mm,
                polish,
                steepest_degrees: Shop::STEEPEST_DEGREES,
                most_blur_mm: None,
                thickness_mm: None,
                facing_mm: side.design.facing.map_or(0.0, |facing| facing.mm),
                least_thickness_mm: Shop::LEAST_THICKNESS_MM,
            },
            direction: pass.direction,
            source: None,
            // Which light there is, is asked for itself.
            tolerances: Tolerances { light_degrees: Vec::new(), ..Tolerances::default() },
        }
    }
}

/// Whether a block is ready to be made.
pub struct ReadyStudy {
    /// The answer, first of all.
    pub verdict: Verdict,
    /// Whether it can be made.
    pub check: CheckStudy,
    /// The cutter's work in simulation.
    pub mill: MillStudy,
    /// What the eye gets of the finished face, and what it is compared with.
    pub seen: (JudgedImage, Image),
    /// The light in words.
    pub light: String,
    /// What is off, and how alike the picture then is in the real light, the worst first.
    pub faults: Vec<(String, Option<Likeness>)>,
    /// What to order.
    pub order: StockOrder,
    /// The block, to be drawn.
    pub solid: Solid,
}

/// Photons by which the spread of the light is checked.
const PHOTONS: u64 = 4_000_000;

impl ReadyStudy {
    /// Asks everything of a block.
    ///
    /// # Errors
    /// A cutter that does not fit the block; a bench or light that cannot be; cancellation.
    /// `form` is what its file holds of the face.
    pub fn of(
        question: &Question,
        piece: &Workpiece,
        form: FaceForm,
        host: &dyn Host,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        let shop = &question.shop;
        question.tolerances.check()?;
        let check = CheckStudy::of(&Makeable::of_workpiece(piece, form, host)?, shop)?;
        let pass = Pass { direction: question.direction, ..Pass::finishing(shop.cutter, shop.step_over_mm) };
        let polish = Some(shop.polish).filter(|polish| polish.sigma_mm() > 0.0);
        let mill = MillStudy::of(piece, pass, polish, progress)?;
        let settings =
            Settings { source_size: question.source.or(piece.side.design.source_size), ..piece.side.design.clone() };
        let light = Light::of(piece, &settings, host)?;
        let seen = light.seen(&mill.last().view.image)?;
        let mut verdict = Verdict::default();
        light.say_picture(&mill, &seen, piece, progress, &mut verdict)?;
        verdict.say_light(if_it_is_the_sun(&piece.bench, &settings).is_none());
        light.say_spread(piece, &settings, host, &mut verdict)?;
        check.say_hard(shop, &mut verdict);
        if form == FaceForm::Triangles {
            light.say_facets(piece, &mut verdict)?;
        }
        let faults = light.faults(tolerance::cases(&question.tolerances, piece, progress)?, progress)?;
        say_faults(&seen, &faults, &mut verdict);
        let target = light.target.clone();
        Ok(Self {
            verdict,
            check,
            mill,
            seen: (seen, target),
            light: light.words,
            faults,
            order: StockOrder::of_side(&piece.side),
            solid: solid_of(piece)?,
        })
    }
}

/// The light that there is.
struct Light {
    psf: Option<Psf>,
    /// What the eye shall see.
    target: Image,
    words: String,
}

impl Light {
    fn of(piece: &Workpiece, settings: &Settings, host: &dyn Host) -> Result<Self, Failure> {
        let pixels = piece.examiner.pixels();
        let psf = psf_of(settings, &piece.bench, pixels, host)?;
        let words = match psf {
            Some(_) => spread_in_words(settings),
            None => "light without a size".to_owned(),
        };
        let target = resampled(&piece.target.picture, pixels.0, pixels.1);
        Ok(Self { psf, target, words })
    }

    /// What is seen where this image falls in perfect light.
    fn spread(&self, image: &Image) -> Image {
        self.psf.as_ref().map_or_else(|| image.clone(), |psf| blurred(image, psf))
    }

    fn seen(&self, image: &Image) -> Result<JudgedImage, Failure> {
        let image = self.spread(image);
        Ok(JudgedImage { metrics: metrics::compare(&image, &self.target).map_err(Failure::refused)?, image })
    }

    fn likeness(&self, image: &Image) -> Result<Likeness, Failure> {
        metrics::likeness(&self.spread(image), &self.target).map_err(Failure::refused)
    }

    /// What the eye gets, and what would do better where that is not enough.
    fn say_picture(
        &self,
        mill: &MillStudy,
        seen: &JudgedImage,
        piece: &Workpiece,
        progress: &dyn Progress,
        verdict: &mut Verdict,
    ) -> Result<(), Failure> {
        let likeness = Likeness::from(&seen.metrics);
        let (answer, words) = seen_in_words(likeness.ssim);
        let designed = self.likeness(&mill.steps[0].view.image)?;
        let mut says = format!("{words} ({}), {}, {}", figures(likeness), mill.done_in_words(), self.words);
        if answer != Answer::Yes {
            // Whether the light or the cutter takes it.
            if seen_in_words(designed.ssim).0 == answer {
                says += &format!(
                    "; the light alone leaves {}: a nearer receiver or a smaller source is sharper",
                    figures(designed)
                );
            } else {
                says += &mill.remedy_in_words(piece, &|image| self.likeness(image), progress)?;
            }
        }
        verdict.say("picture", answer, says);
        Ok(())
    }

    /// Whether photons from a source of that size, through the designed face, see what spreading
    /// the beams' light makes of it.
    fn say_spread(
        &self,
        piece: &Workpiece,
        settings: &Settings,
        host: &dyn Host,
        verdict: &mut Verdict,
    ) -> Result<(), Failure> {
        if self.psf.is_none() {
            return Ok(());
        }
        let subject = Subject::Block(Box::new(with_face(&piece.block, &piece.surface)?.with_spline()));
        let plan = PhotonPlan::new(PHOTONS, 1);
        let view = ImperfectView::of(&subject, &piece.scene(), &piece.target, settings, &plan, host)?;
        let Some(view) = view else { return Ok(()) };
        let Some(photons) = view.photons else { return Ok(()) };
        let off = format!("{:.3} +- {:.3}", photons.between.rel_rms(), photons.between.rel_rms_error());
        let (answer, word) = if photons.confirm() { (Answer::Yes, "confirm") } else { (Answer::But, "do not confirm") };
        verdict.say(
            "spread",
            answer,
            format!("photons from a source of that size, through the designed face, {word} the figures in this light: relative RMS {off} from the beams' light spread on the receiver"),
        );
        Ok(())
    }

    /// What flat triangles do to the picture where they are cut as they are.
    fn say_facets(&self, piece: &Workpiece, verdict: &mut Verdict) -> Result<(), Failure> {
        let subject = Subject::Block(Box::new(piece.block.clone()));
        let image = piece.examiner.trace(&subject, Surface::Facets, Geometry::Displaced)?.image;
        let likeness = self.likeness(&image)?;
        let (answer, words) = seen_in_words(likeness.ssim);
        let figures = figures(likeness);
        let says = match answer {
            Answer::Yes => format!("its triangles may be cut as they are ({figures})"),
            _ => format!(
                "if its triangles are cut as they are, {words} ({figures}): send a STEP, or make it with more `nodes`"
            ),
        };
        // A CAM program may well smooth them.
        verdict.say("triangles", if answer == Answer::Yes { answer } else { Answer::But }, says);
        Ok(())
    }

    /// Faults of the bench in this light, the worst first.
    fn faults(
        &self,
        cases: Vec<ToleranceCase>,
        progress: &dyn Progress,
    ) -> Result<Vec<(String, Option<Likeness>)>, Failure> {
        begin(progress, "spreading the light", cases.len())?;
        let mut faults = Vec::new();
        for ToleranceCase { name, view, .. } in cases {
            let likeness = view.map(|(view, _)| self.likeness(&view.image)).transpose()?;
            faults.push((name, likeness));
            advance(progress, faults.len())?;
        }
        faults.sort_by(|(_, a), (_, b)| ssim_of(a).total_cmp(&ssim_of(b)));
        Ok(faults)
    }
}

/// Says which fault of the bench would change what the eye gets.
fn say_faults(seen: &JudgedImage, faults: &[(String, Option<Likeness>)], verdict: &mut Verdict) {
    let (own, _) = seen_in_words(seen.metrics.ssim);
    let Some((name, worst)) = faults.first() else { return };
    let ssim = ssim_of(worst);
    let (answer, words) = seen_in_words(ssim);
    if answer == own || own == Answer::No {
        verdict.say("bench", Answer::Yes, format!("the worst of what may be off, {name}, leaves SSIM {ssim:.3}"));
    } else {
        let count = faults.iter().filter(|(_, likeness)| seen_in_words(ssim_of(likeness)).0 != own).count();
        let others = if count > 1 { format!(" (and {} other faults lose as much)", count - 1) } else { String::new() };
        verdict.say("bench", Answer::But, format!("with {name} {words} (SSIM {ssim:.3}){others}"));
    }
}

/// That of no picture at all is below every other.
fn ssim_of(likeness: &Option<Likeness>) -> f64 {
    likeness.map_or(f64::NEG_INFINITY, |likeness| likeness.ssim)
}

/// The block with what stands around its face.
fn solid_of(piece: &Workpiece) -> Result<Solid, Failure> {
    // Its skirt is part of its face already.
    let shape = Shape { skirt_mm: 0.0, ..shape(&piece.side.design)? };
    let rise_mm = shape.rim.map_or(0.0, |rim| rim.rise_mm.max(0.0));
    let thickness_mm = Solid::highest_mm(&piece.surface) + rise_mm - piece.block.entry_z_mm();
    let stock = Stock::of_thickness(thickness_mm).leaving_at_least(Stock::LIMITS_MM.0);
    Solid::shaped(&piece.surface, stock, shape).map_err(Failure::refused)
}
