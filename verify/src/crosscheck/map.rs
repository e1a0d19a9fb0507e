//! PhotonAgreement of landing points.

use glam::DVec2;

/// Percentiles that are reported.
pub const PERCENTILES: [f64; 4] = [50.0, 90.0, 99.0, 99.9];

/// Where the verifier's rays land, mm; `None` for rays that never arrive. In the order of pictures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Landings {
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// With interpolated vertex normals over flat triangles, as renderers see the block.
    pub smooth: Vec<Option<DVec2>>,
    /// By the spline surface.
    pub spline: Vec<Option<DVec2>>,
    /// Which rays meet the exit face. The others are not compared.
    pub aimed: Vec<bool>,
}

impl Landings {
    /// Least and greatest corner of all landing points with interpolated normals, mm.
    pub fn range_mm(&self) -> Option<(DVec2, DVec2)> {
        let mut landed = self.smooth.iter().flatten();
        let first = *landed.next()?;
        Some(landed.fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p))))
    }
}

/// Distances between two sets of points.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Distances {
    /// Root of the mean square distance, mm.
    pub rms_mm: f64,
    /// Greatest distance, mm.
    pub worst_mm: f64,
    /// Distances that so many of the rays do not exceed ([`PERCENTILES`]), mm; the first is the
    /// median.
    pub percentiles_mm: [f64; 4],
    /// Mean of the differences, mm: a shift of the whole picture.
    pub shift_mm: DVec2,
}

/// PhotonAgreement of a renderer's landing points with the verifier's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MapAgreement {
    /// Rays that land by both.
    pub rays: usize,
    /// Rays that land by one of them only.
    pub contested: usize,
    /// Distance from the verifier's landing points, with interpolated normals as the renderer has
    /// them.
    pub smooth: Distances,
    /// Distance from the landing points of the spline surface: what a renderer's normals miss of it
    /// is in this.
    pub spline: Distances,
}

impl MapAgreement {
    /// Compares; nothing if no ray lands by both.
    pub(super) fn between(ours: &Landings, theirs: &[Option<DVec2>]) -> Option<Self> {
        let pairs = |ours: &[Option<DVec2>]| -> Vec<DVec2> {
            ours.iter().zip(theirs).filter_map(|(a, b)| Some((*b)? - (*a)?)).collect()
        };
        let one_only =
            |((a, b), aimed): &((&Option<DVec2>, &Option<DVec2>), &bool)| **aimed && a.is_some() != b.is_some();
        let contested = ours.smooth.iter().zip(theirs).zip(&ours.aimed).filter(one_only).count();
        let smooth = pairs(&ours.smooth);
        Some(Self {
            rays: smooth.len(),
            contested,
            smooth: Distances::of(&smooth)?,
            spline: Distances::of(&pairs(&ours.spline))?,
        })
    }
}

impl Distances {
    fn of(differences: &[DVec2]) -> Option<Self> {
        let n = differences.len();
        let mut lengths: Vec<f64> = differences.iter().map(|d| d.length()).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        let worst_mm = *lengths.last()?;
        Some(Self {
            rms_mm: (lengths.iter().map(|l| l * l).sum::<f64>() / n as f64).sqrt(),
            worst_mm,
            // The nearest rank: the least distance that this part of the rays does not exceed.
            percentiles_mm: PERCENTILES.map(|p| lengths[((p / 100.0 * n as f64).ceil() as usize).clamp(1, n) - 1]),
            shift_mm: differences.iter().sum::<DVec2>() / n as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    #[test]
    fn distances_are_ranked_and_rays_of_one_side_only_are_counted() {
        let ours: Vec<Option<DVec2>> = (0..1000).map(|k| (k != 7).then_some(DVec2::splat(f64::from(k)))).collect();
        // Off by 1, 2, ... thousandths along (0.6, 0.8), and one ray that does not arrive.
        let off = |k: usize| (k as f64 + 1.0) * 1e-3 * DVec2::new(0.6, 0.8);
        let theirs: Vec<_> = (0..1000).map(|k| (k != 9).then(|| DVec2::splat(k as f64) + off(k))).collect();
        let landings = Landings { aimed: vec![true; 1000], nx: 100, ny: 10, smooth: ours.clone(), spline: ours };
        let agreement = MapAgreement::between(&landings, &theirs).unwrap();
        assert_eq!((agreement.rays, agreement.contested), (998, 2));
        let d = agreement.smooth;
        assert!((d.worst_mm - 1.0).abs() < 1e-9 && (d.percentiles_mm[0] - 0.501).abs() < 1e-9, "{d:?}");
        assert!((d.percentiles_mm[3] - 1.0).abs() < 1e-9, "{d:?}");
        at_worst(1.5e-5, (d.shift_mm - 0.5015 * DVec2::new(0.6, 0.8)).length(), "shift");
        at_worst(1.01e-3, (d.rms_mm - (1.0f64 / 3.0).sqrt()).abs(), "root mean square");
        assert!(MapAgreement::between(&landings, &vec![None; 1000]).is_none());
    }
}
