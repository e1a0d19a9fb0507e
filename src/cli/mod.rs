//! The command line: one file per subcommand; arguments become typed options once, here.

// What is said goes through `console`.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod check;
mod console;
mod coupon;
mod crosscheck;
mod design;
mod files;
mod machine;
mod memory;
mod mill;
mod outcome;
mod outputs;
mod presets;
mod preview;
mod program;
mod progress;
mod ready;
mod report_files;
mod shards;
mod side_files;
mod stack;
mod sweep;
mod verify;

use crate::{
    failure::Failure,
    record::document,
    solver::{Event, SolveError},
};
use clap::{CommandFactory, Parser, Subcommand};
pub use console::{Caller, fault};
use console::{Reader, say};
pub use files::{Saving, save};
pub use machine::Machine;
use std::{ffi::OsString, path::PathBuf, process::ExitCode, sync::Arc};

const EXAMPLE: &str = "\
Example:
  glasswarp design portrait.png --size 15cm --distance 60cm -o portrait.stl
  glasswarp ready portrait.stl --cutter ball:d6mm --step-over 0.1mm --polish 0.1mm";

const CLOSING: &str =
    "Lengths: um, mm, cm, m, in. Exit codes: 0 fine, 1 file, 2 refused, 3 fell short, 4 no closed solid.";

const TEMPLATE: &str = "\
{before-help}{about}

{usage-heading} {usage}

Commands:
{subcommands}

Options:
{options}{after-help}";

/// Turns a picture into a block of glass whose light draws that picture.
#[derive(Parser)]
#[command(name = "glasswarp", version, before_help = EXAMPLE, after_help = CLOSING, help_template = TEMPLATE, max_term_width = 120, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// Print one JSON document (docs/json.md) in place of text
    #[arg(long, global = true, display_order = 990)]
    json: bool,

    /// Replace files that glasswarp did not write, or that were changed since
    #[arg(long, global = true, display_order = 992)]
    force: bool,

    /// Tell all that was found out, and what takes how long; -vv and -vvv more
    #[arg(short, long, global = true, action = clap::ArgAction::Count, display_order = 991)]
    verbose: u8,
}

#[derive(Subcommand)]
enum Command {
    /// Make a block from a picture, export it, and trace light through it
    #[command(
        after_help = "These are the settings that most people use; 'glasswarp design --help' tells all.",
        after_long_help = ""
    )]
    Design(Box<design::DesignArgs>),
    /// Look at what a picture would become, in a second or two
    Preview(Box<preview::PreviewArgs>),
    /// Trace light through a block and judge the picture that it draws
    Verify(Box<verify::VerifyArgs>),
    /// Say whether a block can be made, and what tolerances do to its picture
    Check(check::CheckArgs),
    /// Mill and polish a block in simulation, and judge every step
    Mill(mill::MillArgs),
    /// Ask all that matters before a slab is paid for; one sheet to print
    Ready(ready::ReadyArgs),
    /// Make a test coupon that tells polish, index, step-over and direction of a bench
    Coupon(coupon::CouponArgs),
    /// Show a block to an independent renderer, and compare
    Crosscheck(crosscheck::CrosscheckArgs),
    /// List the materials known by name
    Materials,
    /// List common set-ups to start from
    Presets(presets::PresetsArgs),
    /// Print completions for a shell
    Completions(CompletionsArgs),
    /// Print the manual, or write a page for every command
    Man(ManArgs),
}

#[derive(clap::Args)]
struct CompletionsArgs {
    /// The shell
    shell: clap_complete::Shell,
}

#[derive(clap::Args)]
struct ManArgs {
    /// Write a page for every command into this folder
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

impl Command {
    fn name(&self) -> &'static str {
        match self {
            Self::Design(_) => "design",
            Self::Preview(_) => "preview",
            Self::Verify(_) => "verify",
            Self::Check(_) => "check",
            Self::Mill(_) => "mill",
            Self::Ready(_) => "ready",
            Self::Coupon(_) => "coupon",
            Self::Crosscheck(_) => "crosscheck",
            Self::Materials => "materials",
            Self::Presets(_) => "presets",
            Self::Completions(_) => "completions",
            Self::Man(_) => "man",
        }
    }

    fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Design(args) if args.then.is_empty() => design::run(args),
            Self::Design(args) => stack::run(args),
            Self::Preview(args) => preview::run(args),
            Self::Verify(args) => verify::run(args),
            Self::Check(args) => check::run(args),
            Self::Mill(args) => mill::run(args),
            Self::Ready(args) => ready::run(args),
            Self::Coupon(args) => coupon::run(args),
            Self::Crosscheck(args) => crosscheck::run(args),
            Self::Materials => {
                materials();
                Ok(())
            }
            Self::Presets(args) => presets::run(args),
            Self::Completions(args) => completions(args),
            Self::Man(args) => manual(args),
        }
    }
}

/// Parses the words of this process, runs, and reports.
pub fn run() -> ExitCode {
    ExitCode::from(run_with(std::env::args_os().skip(1).collect()))
}

/// The same for these words, without the program's own name. Returns the exit code.
pub fn run_with(words: Vec<OsString>) -> u8 {
    let in_json = words.iter().any(|word| word == "--json");
    let cli = match parsed(&words) {
        Ok(cli) => cli,
        // A program is told in its own way.
        Err(error) if error.use_stderr() && in_json => {
            console::open(Reader::Program, words, 0);
            return console::close("", Err(misused(&error))).exit_code;
        }
        Err(error) => {
            let _ = error.print();
            return error.exit_code() as u8;
        }
    };
    console::open(if cli.json { Reader::Program } else { Reader::Person }, words, cli.verbose);
    outputs::force(cli.force);
    // Nothing half-written stays behind: outputs are written under another name until they are
    // whole.
    let handler = ctrlc::set_handler(|| {
        let _held = crate::export::remove_unfinished();
        console::interrupted();
        std::process::exit(130);
    });
    if let Err(error) = handler {
        console::warn(format_args!("an interruption cannot be handled ({error})"));
    }
    console::close(cli.command.name(), cli.command.run()).exit_code
}

/// Runs a command for a caller within this process, which is told everything: nothing is printed,
/// and signals are the caller's. One runs at a time, and others wait for it.
///
/// # Errors
/// Words that are no command.
pub fn ask(words: Vec<OsString>, caller: Arc<dyn Caller>) -> Result<document::Document, clap::Error> {
    let cli = parsed(&words)?;
    let _turn = outputs::turn();
    let is_wanted = caller.report(Event::Iteration).is_continue();
    console::open(Reader::Caller(caller), words, cli.verbose);
    outputs::force(cli.force);
    let done = if is_wanted { cli.command.run() } else { Err(Failure::refused(SolveError::Cancelled)) };
    Ok(console::close(cli.command.name(), done))
}

/// Every command with its flags.
pub fn command() -> clap::Command {
    Cli::command()
}

fn parsed(words: &[OsString]) -> Result<Cli, clap::Error> {
    outcome::learn_flags(&Cli::command());
    Cli::try_parse_from(std::iter::once(&OsString::from("glasswarp")).chain(words))
}

fn misused(error: &clap::Error) -> Failure {
    Failure::Usage(error.to_string().trim_start_matches("error: ").to_owned())
}

fn materials() {
    say!("{:<14} {:>7}  {:<66}  source", "name", "index", "description");
    let mut list = Vec::new();
    for material in crate::materials::MATERIALS {
        say!("{:<14} {:>7}  {:<66}  {}", material.name, material.ior, material.description, material.source);
        list.push(document::Material {
            name: material.name.to_owned(),
            ior: material.ior,
            description: material.description.to_owned(),
            source: material.source.to_owned(),
        });
    }
    console::result(document::Result::Materials(document::Materials { materials: list }));
}

/// Prints bytes made by another library, and keeps them for a program.
fn print_text(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes).into_owned();
    say!("{}", text.trim_end());
    console::result(document::Result::Text(document::Text { text }));
}

fn completions(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "glasswarp", &mut script);
    print_text(&script);
    Ok(())
}

fn manual(args: &ManArgs) -> Result<(), Failure> {
    let mut command = Cli::command();
    command.build();
    let page = |command: clap::Command| {
        let mut page = Vec::new();
        clap_mangen::Man::new(command)
            .render(&mut page)
            .map(|()| page)
            .map_err(|source| Failure::Io { what: "the manual cannot be written".into(), source: source.into() })
    };
    let Some(folder) = &args.output else {
        print_text(&page(command)?);
        return Ok(());
    };
    let pages = std::iter::once((String::from("glasswarp"), command.clone())).chain(
        command
            .get_subcommands()
            .filter(|sub| sub.get_name() != "help")
            .map(|sub| (format!("glasswarp-{}", sub.get_name()), sub.clone().disable_help_subcommand(true))),
    );
    let pages: Vec<_> = pages.map(|(name, command)| (folder.join(format!("{name}.1")), command)).collect();
    outputs::plan([], pages.iter().map(|(path, _)| path.clone()))?;
    let mut written = Vec::new();
    for (path, command) in pages {
        let page = page(command)?;
        crate::export::write_atomically(&path, |out| std::io::Write::write_all(out, &page))
            .map_err(Failure::writing)?;
        written.push(path.display().to_string());
    }
    say!("{}", written.join("\n"));
    console::result(document::Result::Text(document::Text { text: written.join("\n") }));
    Ok(())
}
