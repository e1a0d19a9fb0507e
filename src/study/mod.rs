//! What is found out about a block: typed questions, typed answers. Nothing here prints, knows a
//! command line, or opens a file but through its [`Host`](crate::spec::Host).
//!
//! A [`Plan`](design::Plan) is a design that can be made;
//! [`DesignVerification`](verification::DesignVerification) judges its files. Any other solid is
//! [placed](placement) and [judged](judge), [checked](check), [milled](mill), put under
//! [tolerances](tolerance), [swept](sweep), and seen in [white light](white). What a machine's
//! program makes of one is [found by running it](program).
//!
//! Settings that messages speak of stand in backticks.

pub mod before;
pub mod behind;
pub mod bench;
pub mod budget;
pub mod changed;
pub mod check;
pub mod coupon;
pub mod crosscheck;
pub mod cutters;
pub mod design;
pub mod diagnosis;
pub mod face;
pub mod finish;
pub mod fits;
pub mod imperfect;
pub mod judge;
mod lamp;
pub mod material;
pub mod mill;
pub mod order;
pub mod placement;
pub mod program;
mod progress;
pub mod ready;
pub mod requirements;
pub mod side_record;
pub mod stack;
pub mod stand;
pub mod sweep;
pub mod tally;
pub mod target_light;
pub mod tolerance;
pub mod verdict;
pub mod verification;
pub mod white;
pub mod workpiece;
