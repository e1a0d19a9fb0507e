//! The profile of a cutter, and where a cutter on its way touches what it leaves.

use crate::program::Tool;

/// Height of a cutter's surface above its tip, as a function of the distance from its axis.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    disc: f64,
    corner: f64,
    cone: f64,
    radius: f64,
    /// Where the corner ends and the cone begins, and the height there, mm.
    joint: (f64, f64),
}

/// No face is as steep as this; what is steeper is a wall.
const STEEPEST: f64 = 1e4;
/// What lies on the very edge of a cutter is within its reach, but for rounding.
const EDGE: f64 = 1.0 + 1e-12;
/// Steps towards the place where the torus of a bull-nose cutter touches.
const STEPS: usize = 70;
/// Steps after which only halving is trusted.
const QUICK: usize = 16;

impl Profile {
    /// The profile of a tool.
    pub fn of(tool: &Tool) -> Self {
        let Tool { disc_mm: disc, corner_mm: corner, cone, radius_mm: radius } = *tool;
        let joint = if cone.is_finite() {
            let sin = cone / (1.0 + cone * cone).sqrt();
            let end = disc + corner * sin;
            (end, corner * (1.0 - (1.0 - sin * sin).max(0.0).sqrt()))
        } else {
            (radius, corner)
        };
        Self { disc, corner, cone, radius, joint }
    }

    /// Greatest distance from the axis, mm.
    #[inline]
    pub fn radius_mm(&self) -> f64 {
        self.radius
    }

    /// Height above the tip, mm; infinite beyond the radius.
    #[inline]
    pub fn height_mm(&self, from_axis: f64) -> f64 {
        if from_axis > self.radius * EDGE {
            return f64::INFINITY;
        }
        let beyond = from_axis - self.disc;
        if beyond <= 0.0 {
            0.0
        } else if from_axis <= self.joint.0 {
            self.corner - (self.corner * self.corner - beyond * beyond).max(0.0).sqrt()
        } else if self.cone.is_finite() {
            self.joint.1 + self.cone * (from_axis - self.joint.0)
        } else {
            self.joint.1
        }
    }

    /// The slope of the height, bounded.
    #[inline]
    pub fn slope(&self, from_axis: f64) -> f64 {
        let beyond = from_axis - self.disc;
        if beyond <= 0.0 {
            0.0
        } else if from_axis <= self.joint.0 {
            let depth = (self.corner * self.corner - beyond * beyond).max(0.0).sqrt();
            (beyond / depth.max(1e-300)).min(STEEPEST)
        } else {
            self.cone.min(STEEPEST)
        }
    }

    /// How far behind a point the axis of a cutter is that touches what it leaves there, counted
    /// along its way; the way passes the point at the distance `aside`, no more than the radius,
    /// and rises by `rise` mm per mm. It is where `slope(r) w / r = rise`, with `r² = w² + aside²`,
    /// or the furthest place that reaches the point.
    #[inline]
    pub fn behind_mm(&self, rise: f64, aside: f64) -> f64 {
        if rise == 0.0 {
            return 0.0;
        }
        let steep = rise.abs();
        let reach = (self.radius * self.radius - aside * aside).max(0.0).sqrt();
        let along = if self.disc == 0.0 && self.corner > 0.0 {
            let square = self.corner * self.corner - aside * aside;
            let ball = if square > 0.0 { steep / (1.0 + steep * steep).sqrt() * square.sqrt() } else { f64::INFINITY };
            if ball.hypot(aside) <= self.joint.0 { ball } else { self.on_cone(steep, aside, reach) }
        } else if self.corner == 0.0 {
            self.on_cone(steep, aside, reach)
        } else {
            self.on_torus(steep, aside, reach)
        };
        along.min(reach).copysign(rise)
    }

    /// The same where the cone, or the edge below it, touches.
    fn on_cone(&self, steep: f64, aside: f64, reach: f64) -> f64 {
        if !self.cone.is_finite() || steep >= self.cone {
            return reach;
        }
        let part = steep / self.cone;
        let from_axis = (aside / (1.0 - part * part).sqrt()).max(self.joint.0);
        (from_axis * from_axis - aside * aside).max(0.0).sqrt()
    }

    /// The same where the torus touches: `tan(phi) sqrt(1 - (aside / r)²) = rise`, `r = disc +
    /// corner sin(phi)`. The left side grows with `phi`.
    fn on_torus(&self, steep: f64, aside: f64, reach: f64) -> f64 {
        let from_axis = |sin: f64| self.disc + self.corner * sin;
        let lean = |r: f64| (1.0 - (aside / r).powi(2)).max(0.0).sqrt();
        let (mut low, mut high) = (((aside - self.disc) / self.corner).clamp(0.0, 1.0), 1.0);
        let mut sin = (steep / (1.0 + steep * steep).sqrt()).max(low);
        for step in 0..STEPS {
            let wanted = steep / lean(from_axis(sin)).max(1e-12);
            let next = wanted / (1.0 + wanted * wanted).sqrt();
            // The fixed point lies between: where this one is too small, the next is larger.
            if next > sin {
                low = sin;
            } else {
                high = sin;
            }
            let next = if step < QUICK && next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - sin).abs() < 1e-13 {
                break;
            }
            sin = next;
        }
        let r = from_axis(sin);
        if r <= self.joint.0 { (r * r - aside * aside).max(0.0).sqrt() } else { self.on_cone(steep, aside, reach) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tools() -> Vec<Tool> {
        ["ball:d6mm", "flat:d6mm", "bull:d6mm,r1mm", "vee:90deg,d6mm", "vee:60deg,d6mm,d1mm", "taper:r1mm,10deg,d6mm"]
            .map(|text| text.parse().unwrap())
            .to_vec()
    }

    #[test]
    fn profiles_have_the_slopes_that_they_say_and_are_convex() {
        for tool in tools() {
            let profile = Profile::of(&tool);
            let (mut last, e) = (0.0, 1e-6);
            for k in 0..290 {
                let r = 0.0103 * f64::from(k) + 0.0007;
                let difference = (profile.height_mm(r + e) - profile.height_mm(r - e)) / (2.0 * e);
                assert!((difference - profile.slope(r)).abs() < 2e-6 * (1.0 + difference.powi(3)), "{tool} at {r}");
                assert!(profile.slope(r) >= last, "{tool} at {r}");
                last = profile.slope(r);
            }
            assert_eq!(profile.height_mm(3.01), f64::INFINITY);
        }
        let ball = Profile::of(&Tool::ball(3.0));
        assert!((ball.height_mm(1.8) - 0.6).abs() < 1e-15);
    }

    #[test]
    fn the_cutter_touches_where_no_other_place_on_its_way_is_lower() {
        for tool in tools() {
            let profile = Profile::of(&tool);
            for (k, rise) in [0.0, 1e-6, 0.03, -0.2, 0.9, -1.5, 4.0, 30.0].into_iter().enumerate() {
                for aside in [0.0, 0.2, 0.77, 1.3, 2.1, 2.99] {
                    let height = |w: f64| -rise * w + profile.height_mm(w.hypot(aside));
                    let touches = height(profile.behind_mm(rise, aside));
                    let reach = (9.0f64 - aside * aside).sqrt();
                    let searched = (-2000..=2000)
                        .map(|i| height(f64::from(i) / 2000.0 * reach * (1.0 - 1e-15)))
                        .fold(f64::INFINITY, f64::min);
                    assert!(touches <= searched + 1e-9, "{tool}, rise {rise}, aside {aside}: {touches} > {searched}");
                    assert!(
                        touches >= searched - 2e-2 * (1.0 + rise.abs()),
                        "{k}: {tool}, {rise}, {aside}: {touches} < {searched}"
                    );
                }
            }
        }
    }
}
