//! `tesdf man [COMMAND]`: prints a manual page.
use clap::{Command, CommandFactory};

use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf man`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The command whose page is printed [default: tesdf itself]
    #[arg(conflicts_with = "list")]
    pub command: Option<String>,
    /// Print the names of all commands that have a page, one a line
    #[arg(long)]
    pub list: bool,
}

/// Prints the page, in the format of `man`.
///
/// # Errors
/// There is no such command, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut tesdf = crate::Cli::command();
    tesdf.build();
    let has_page = |command: &&Command| !command.is_hide_set() && command.get_name() != "help";
    let names = tesdf.get_subcommands().filter(has_page).map(Command::get_name);
    if args.list {
        report::result(names.flat_map(|name| [name, "\n"]).collect::<String>().as_bytes())?;
        return Ok(Outcome::Good);
    }
    let page = match &args.command {
        None => clap_mangen::Man::new(tesdf.clone()),
        Some(name) => {
            let command = tesdf.get_subcommands().filter(has_page).find(|command| command.get_name() == name);
            let command = command.ok_or_else(|| {
                Failure::new(format!("there is no command {name}"))
                    .hint("tesdf man --list prints their names")
            })?;
            // Pages are found by `man tesdf-encode`.
            clap_mangen::Man::new(command.clone()).title(format!("tesdf-{name}"))
        }
    };
    let page = page.source(format!("tesdf {}", env!("CARGO_PKG_VERSION"))).manual("tesdf");
    let mut text = Vec::new();
    page.render(&mut text).map_err(|e| Failure::new(format!("cannot write the page: {e}")))?;
    report::result(&text)?;
    Ok(Outcome::Good)
}
