//! A solve that nobody waits for ends, whichever solver it is and wherever it stands.

use glam::DVec3;
use glasswarp::{
    bench::{Bench, ExitFace},
    grid::{Extent, Field, Outline},
    irradiance::TargetIrradiance,
    light::Intensity,
    solver::{Event, Problem, Progress, Silent, SolveError, Solver},
    transport::{Transport, TransportOptions},
    warp::{Warping, WarpingPaper},
};
use std::{cell::Cell, ops::ControlFlow, time::Duration};

const NODES: (usize, usize) = (65, 65);

/// Ends the work at the question after so many, by a clock that counts the questions.
struct Patience {
    asked: Cell<usize>,
    after: usize,
}

impl Progress for Patience {
    fn report(&self, _event: Event<'_>) -> ControlFlow<()> {
        self.asked.set(self.asked.get() + 1);
        if self.asked.get() > self.after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn clock(&self) -> Duration {
        Duration::from_secs(self.asked.get() as u64)
    }
}

fn target() -> TargetIrradiance {
    TargetIrradiance::new(Field::from_fn(32, 32, |i, j| {
        let spot = |x: f64, y: f64| (-((i as f64 - x).powi(2) + (j as f64 - y).powi(2)) / 20.0).exp();
        0.2 + spot(10.0, 12.0) + 0.5 * spot(24.0, 20.0)
    }))
    .unwrap()
}

#[test]
fn every_solver_ends_wherever_it_is_cancelled() {
    let bench = Bench::new(Extent::new(60.0, 60.0), 200.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let disc = bench.clone().with_outline(Outline::Circle).unwrap();
    let lamp = bench.clone().with_point_source(DVec3::new(0.0, 0.0, -300.0), 10.0, Intensity::Isotropic).unwrap();
    let softened = Transport::new(TransportOptions::default().with_min_radius_mm(5.0)).unwrap();
    let solvers: [(&str, &dyn Solver, &Bench); 6] = [
        ("transport", &Transport::default(), &bench),
        ("transport, disc", &Transport::default(), &disc),
        ("transport, lamp", &Transport::default(), &lamp),
        ("transport, least radius", &softened, &bench),
        ("warping", &Warping::default(), &bench),
        ("warping-paper", &WarpingPaper::default(), &bench),
    ];
    for (name, solver, bench) in solvers {
        let patient = Patience { asked: Cell::new(0), after: usize::MAX };
        let whole = solver.solve(&Problem::new(bench, &target()), NODES, &patient).unwrap();
        let questions = patient.asked.get();
        assert!(questions > 20, "{name} asks {questions} times");
        let timed: f64 = whole.summary.levels.iter().map(|level| level.elapsed.as_secs_f64()).sum();
        assert!(timed > 0.5 * questions as f64, "{name}: levels tell {timed} of {questions}");
        // Who asks does not change what is found.
        let silent = solver.solve(&Problem::new(bench, &target()), NODES, &Silent).unwrap();
        assert!(silent.exit == whole.exit, "{name}");
        for after in [0, 1, questions / 3, questions / 2, questions - 1] {
            let impatient = Patience { asked: Cell::new(0), after };
            let ended = solver.solve(&Problem::new(bench, &target()), NODES, &impatient);
            assert_eq!(ended.unwrap_err(), SolveError::Cancelled, "{name} after {after} of {questions}");
            assert!(impatient.asked.get() <= after + 2, "{name} asks on after it was cancelled");
        }
    }
}
