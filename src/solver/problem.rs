use super::SolveError;
use crate::{
    bench::{Bench, BenchError, Receiver},
    irradiance::TargetIrradiance,
};

/// Irradiance that shall be drawn, and the receiver on which.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Target<'a> {
    /// What the window of the receiver shall show.
    pub irradiance: &'a TargetIrradiance,
    /// Where it stands, and where on it the window lies.
    pub receiver: Receiver,
}

/// Which faces of the block a solver may choose; the others are planar, across the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum FreeFaces {
    /// The exit face, or the face of a mirror: one picture can be drawn.
    #[default]
    Exit,
    /// Both faces of a block of glass: two pictures can be drawn, on receivers one behind the
    /// other.
    EntryAndExit {
        /// Between the mean planes of both, mm.
        thickness_mm: f64,
    },
}

impl FreeFaces {
    /// How many there are.
    pub const fn count(self) -> usize {
        match self {
            Self::Exit => 1,
            Self::EntryAndExit { .. } => 2,
        }
    }
}

/// What a solver is asked for: a bench, the pictures to draw on it, and the faces that may be
/// chosen.
///
/// There is at least one target, and the first is drawn on the receiver of the bench.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem<'a> {
    bench: &'a Bench,
    targets: Vec<Target<'a>>,
    free: FreeFaces,
}

impl<'a> Problem<'a> {
    /// One target on the receiver of the bench, and a free exit face.
    pub fn new(bench: &'a Bench, irradiance: &'a TargetIrradiance) -> Self {
        let first = Target { irradiance, receiver: *bench.receiver() };
        Self { bench, targets: vec![first], free: FreeFaces::Exit }
    }

    /// The same with another target besides.
    ///
    /// # Errors
    /// A receiver that the bench [refuses](Bench::check_receiver).
    pub fn and_target(mut self, irradiance: &'a TargetIrradiance, receiver: Receiver) -> Result<Self, BenchError> {
        self.bench.check_receiver(&receiver)?;
        self.targets.push(Target { irradiance, receiver });
        Ok(self)
    }

    /// The same with other free faces.
    #[must_use]
    pub fn with_free_faces(self, free: FreeFaces) -> Self {
        Self { free, ..self }
    }

    /// Where block, light and the first receiver stand.
    pub fn bench(&self) -> &'a Bench {
        self.bench
    }

    /// What shall be drawn; never empty.
    pub fn targets(&self) -> &[Target<'a>] {
        &self.targets
    }

    /// Which faces may be chosen.
    pub fn free_faces(&self) -> FreeFaces {
        self.free
    }

    /// Bench and target for a solver that draws one picture by one face.
    ///
    /// # Errors
    /// [`SolveError::Targets`] and [`SolveError::FreeFaces`].
    pub(crate) fn single(&self, solver: &'static str) -> Result<(&'a Bench, &'a TargetIrradiance), SolveError> {
        let (targets, faces) = (self.targets.len(), self.free.count());
        if faces > 1 {
            return Err(SolveError::FreeFaces { solver, faces, limit: 1 });
        }
        match self.targets[..] {
            [target] => Ok((self.bench, target.irradiance)),
            _ => Err(SolveError::Targets { solver, targets, limit: 1 }),
        }
    }
}
