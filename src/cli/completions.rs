//! `isomorph completions` and `isomorph man`: what shells and `man` are given, made from the command line itself.

use std::path::PathBuf;

use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

use super::{Cli, Failure, Result, print};

/// Print what a shell needs to complete commands and options
///
/// For example: isomorph completions bash > ~/.local/share/bash-completion/completions/isomorph
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

/// Print the manual page, or write those of all commands into a folder
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Folder for isomorph.1, isomorph-train.1 and so on, such as ~/.local/share/man/man1
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(super) fn completions(args: &CompletionsArgs) -> Result {
    let mut text = Vec::new();
    generate(args.shell, &mut Cli::command(), "isomorph", &mut text);
    print(&String::from_utf8_lossy(&text))
}

pub(super) fn man(args: &ManArgs) -> Result {
    let Some(folder) = &args.output else {
        let mut text = Vec::new();
        let page = clap_mangen::Man::new(Cli::command());
        page.render(&mut text).map_err(Failure::Output)?;
        return print(&String::from_utf8_lossy(&text));
    };
    let failed = |error| Failure::Failed(format!("{}: {error}", folder.display()));
    std::fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(Cli::command(), folder).map_err(failed)
}
