//! The light of a block after the finish that it is designed for.

use super::{
    face::surface_of,
    judge::{Examiner, Subject},
    mill::{mill, polished},
    workpiece::{JudgedImage, view, view_milled, walls_of},
};
use crate::{fabricate::Pass, failure::Failure, record::document, spec::FinishPlan, surface::Polish};

/// The light of a block after its finish.
pub struct Finished {
    /// The finish.
    pub plan: FinishPlan,
    /// The light after it.
    pub view: JudgedImage,
    /// Relative RMS errors after a polish a tenth weaker and a tenth stronger than planned.
    pub off: Option<[f64; 2]>,
}

impl Finished {
    /// Cuts the block as planned, if the rows are, and polishes it.
    pub fn of(plan: FinishPlan, subject: &Subject, examiner: &Examiner) -> Result<Self, Failure> {
        let Subject::Block(block) = subject else {
            return Err(Failure::Usage("only a block can be finished".into()));
        };
        let design = surface_of(block)?;
        let cut = match (plan.cutter, plan.step_over_mm) {
            (Some(cutter), Some(step_over_mm)) => {
                let walls = walls_of(block, &design, cutter);
                Some(mill(&design, &Pass::finishing(cutter, step_over_mm), walls.as_ref())?)
            }
            _ => None,
        };
        let (view, off) = match (plan.polish, cut) {
            (Some(polish), cut) => {
                let surface = cut.as_ref().map_or(&design, |milled| &milled.surface);
                let after = |share: f64| -> Result<JudgedImage, Failure> {
                    let polish = Polish::new(share * polish.sigma_mm()).map_err(Failure::refused)?;
                    view(examiner, block, &polished(surface, &design, polish))
                };
                let off = [after(0.9)?, after(1.1)?].map(|view| view.metrics.rel_rms);
                (view(examiner, block, &polished(surface, &design, polish))?, Some(off))
            }
            (None, Some(milled)) => (view_milled(examiner, block, &design, milled)?.0, None),
            (None, None) => (view(examiner, block, &design)?, None),
        };
        Ok(Self { plan, view, off })
    }

    /// The same for programs.
    pub fn document(&self) -> document::Finished {
        document::Finished {
            rel_rms: document::finite(self.view.metrics.rel_rms),
            ssim: document::finite(self.view.metrics.ssim),
            if_off: self.off.map(|off| off.map(document::finite)),
        }
    }
}
