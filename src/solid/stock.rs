use super::SolidError;

/// How thick the sheet is that the block is cut from, and how much of it must remain.
///
/// The thickness of a block is counted from its entry face to the *highest* point of its exit face.
/// The sheet to buy is thicker by what is faced off its top before the face is cut, since no sheet
/// is as thick as its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stock {
    sheet: Sheet,
    least_mm: f64,
    facing_mm: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Sheet {
    Thinnest,
    Of(f64),
}

/// Thicknesses in which sheets of acrylic and glass are commonly sold, mm.
pub const STANDARD_SHEETS_MM: [f64; 25] = [
    3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 18.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 60.0, 70.0, 80.0, 90.0,
    100.0, 110.0, 120.0, 150.0, 200.0,
];

impl Stock {
    /// What must remain at the thinnest place unless another least is asked for, mm: less than this
    /// and acrylic bends under the cutter and the polishing pad.
    pub const LEAST_MM: f64 = 3.0;
    /// What is faced off the top of a sheet unless something else is asked for, mm.
    pub const FACING_MM: f64 = 0.5;
    /// What may be faced off, mm, at most.
    pub const MOST_FACING_MM: f64 = 10.0;
    /// Accepted thicknesses of a sheet and of its thinnest place, mm. Below the lower one the wall
    /// triangles would come near the resolution of the files.
    pub const LIMITS_MM: (f64, f64) = (0.1, 10_000.0);

    /// The thinnest of the [standard sheets](STANDARD_SHEETS_MM) that leaves enough.
    pub const fn thinnest_sheet() -> Self {
        Self { sheet: Sheet::Thinnest, least_mm: Self::LEAST_MM, facing_mm: 0.0 }
    }

    /// A block of this thickness, mm.
    pub const fn of_thickness(thickness_mm: f64) -> Self {
        Self { sheet: Sheet::Of(thickness_mm), least_mm: Self::LEAST_MM, facing_mm: 0.0 }
    }

    /// The same with another least thickness, mm.
    pub const fn leaving_at_least(self, least_mm: f64) -> Self {
        Self { least_mm, ..self }
    }

    /// The same with this much faced off the top of the sheet, mm: a block of the thinnest sheet is
    /// so much thinner, and one of a given thickness takes a sheet that is so much thicker.
    pub const fn faced(self, facing_mm: f64) -> Self {
        Self { facing_mm, ..self }
    }

    /// What is faced off the top of the sheet, mm.
    pub const fn facing_mm(self) -> f64 {
        self.facing_mm
    }

    /// What must remain at the thinnest place, mm.
    pub const fn least_mm(self) -> f64 {
        self.least_mm
    }

    /// The thinnest [standard sheet](STANDARD_SHEETS_MM) for a block of this thickness, mm, with
    /// what is faced off; none if no sheet is thick enough.
    pub fn sheet_for(thickness_mm: f64, facing_mm: f64) -> Option<f64> {
        // A block of a sheet less its facing may have been rounded.
        STANDARD_SHEETS_MM.into_iter().find(|sheet| *sheet >= thickness_mm + facing_mm - 1e-3)
    }

    /// Refuses thicknesses that no relief at all would fit, before a surface is solved for.
    ///
    /// # Errors
    /// A thickness out of range, or a sheet thinner than what must remain of it.
    pub fn check(self) -> Result<(), SolidError> {
        self.thickness_mm(0.0).map(drop)
    }

    /// Thickness of the block for a relief of this depth, mm.
    pub(super) fn thickness_mm(self, relief_mm: f64) -> Result<f64, SolidError> {
        let (least, greatest) = Self::LIMITS_MM;
        let valid = |what, value_mm: f64| {
            let fault = SolidError::Thickness { what, value_mm, least_mm: least, greatest_mm: greatest };
            if (least..=greatest).contains(&value_mm) { Ok(value_mm) } else { Err(fault) }
        };
        let least_mm = valid("the least thickness of the block", self.least_mm)?;
        if !(0.0..=Self::MOST_FACING_MM).contains(&self.facing_mm) {
            return Err(SolidError::Facing { value_mm: self.facing_mm, greatest_mm: Self::MOST_FACING_MM });
        }
        let faced = STANDARD_SHEETS_MM.into_iter().map(|sheet| sheet - self.facing_mm);
        let standard = faced.clone().find(|thickness| thickness - relief_mm >= least_mm);
        match self.sheet {
            Sheet::Thinnest => standard.ok_or(SolidError::TooDeep {
                relief_mm,
                least_mm,
                thickest_mm: STANDARD_SHEETS_MM[STANDARD_SHEETS_MM.len() - 1] - self.facing_mm,
            }),
            Sheet::Of(thickness_mm) => {
                valid("the thickness of the stock", thickness_mm)?;
                let thinnest_mm = thickness_mm - relief_mm;
                // A sheet that was chosen for exactly this relief must not fail by a rounding
                // error.
                if thinnest_mm < least_mm - 1e-9 {
                    let enough_mm = standard.unwrap_or_else(|| (relief_mm + least_mm).ceil());
                    return Err(SolidError::TooThin { thickness_mm, relief_mm, thinnest_mm, least_mm, enough_mm });
                }
                Ok(thickness_mm)
            }
        }
    }
}

impl Default for Stock {
    fn default() -> Self {
        Self::thinnest_sheet()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thinnest_standard_sheet_that_leaves_enough_is_chosen() {
        let stock = Stock::thinnest_sheet();
        assert_eq!(stock.thickness_mm(0.0), Ok(3.0));
        assert_eq!(stock.thickness_mm(1.0), Ok(4.0));
        assert_eq!(stock.thickness_mm(1.001), Ok(5.0));
        assert_eq!(stock.leaving_at_least(8.0).thickness_mm(6.2), Ok(15.0));
        assert!(matches!(stock.thickness_mm(198.0), Err(SolidError::TooDeep { .. })));
    }

    #[test]
    fn what_is_faced_off_makes_the_block_thinner_or_the_sheet_thicker() {
        let faced = Stock::thinnest_sheet().faced(0.5);
        assert_eq!(faced.thickness_mm(1.0), Ok(4.5));
        assert_eq!(Stock::sheet_for(4.5, 0.5), Some(5.0));
        assert_eq!(Stock::of_thickness(12.0).faced(0.5).thickness_mm(1.0), Ok(12.0));
        assert_eq!(Stock::sheet_for(12.0, 0.5), Some(15.0));
        assert_eq!(Stock::sheet_for(200.0, 0.5), None);
        for bad in [-0.1, 10.1, f64::NAN] {
            assert!(matches!(faced.faced(bad).thickness_mm(1.0), Err(SolidError::Facing { .. })));
        }
    }

    #[test]
    fn a_sheet_too_thin_is_refused_with_the_numbers_and_the_remedy() {
        assert_eq!(Stock::of_thickness(6.8).thickness_mm(3.8), Ok(6.8));
        let error = Stock::of_thickness(5.0).thickness_mm(3.8).unwrap_err().to_string();
        for part in ["5 mm", "1.20 mm", "3.80 mm", "3 mm", "a stock of 8 mm"] {
            assert!(error.contains(part), "{part} in {error}");
        }
        for bad in [0.0, -3.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Stock::of_thickness(bad).thickness_mm(1.0), Err(SolidError::Thickness { .. })));
            let stock = Stock::thinnest_sheet().leaving_at_least(bad);
            assert!(matches!(stock.thickness_mm(1.0), Err(SolidError::Thickness { .. })));
        }
    }
}
