//! Files that appear whole or not at all, and never in the place of somebody's own.
//!
//! [`write_atomically`] is the one way in which files are written. A program that works for a
//! person says with a [`Plan`] what it will read and write before it begins. Once a plan is
//! [approved](Plan::approve), every file that is written is entered in the record of its folder,
//! `.glasswarp.sha256`, before it takes its name: so a file whose content is in the record is this
//! program's own and may be renewed, and one that is not, or is no longer as it was written, is
//! somebody's and stays. `sha256sum -c .glasswarp.sha256` reads the record too. Without a plan, as
//! in a library, nothing is recorded and nothing refused.

mod atomic;
mod error;
mod guard;
mod identity;
mod plan;
mod record;

pub use atomic::{Held, probe, remove_unfinished, write_atomically};
pub use error::{PlanError, WriteError};
pub use guard::{enter, may_replace};
pub use plan::Plan;
pub use record::{NAME, sha256};
