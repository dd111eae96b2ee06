//! Tips on words of a command line that begin with a hyphen, but are no options.

use clap::{Arg, Command};

use super::name_request::{find_option, takes_names};
use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::{is_address, without_password};

/// Returns a tip on a word that begins with a hyphen: the value of the option before it or, if the command takes ids, an id.
/// `option` is the unknown option that was found in it, and `words` the command line without the name of the program.
pub(crate) fn hyphen_tip<'w>(
    mut program: Command,
    option: &str,
    mut words: impl Iterator<Item = &'w str>,
) -> Option<String> {
    program.build();
    let mut current = &program;
    let (mut before, mut arguments) = (Vec::<&str>::new(), Vec::<&str>::new());
    let mut id = None;
    // The option whose value the next word is.
    let mut open: Option<&Arg> = None;
    while let Some(word) = words.next() {
        if word == "--" {
            arguments.extend(words.by_ref());
            break;
        }
        let begins_with_hyphen = word.starts_with('-') && word.len() > 1;
        let found = begins_with_hyphen.then(|| find_option(current, word));
        let is_meant = id.is_none() && matches!(found, Some(None)) && has_option(word, option);
        if let Some(long) = open.take().map(Arg::get_long) {
            if is_meant {
                let long = long?;
                let joined = shell_quoted(&format!("--{long}={word}"));
                return Some(format!(
                    "if {word} is the value of --{long}, write = between them, as in: {joined}"
                ));
            }
            before.push(word);
        } else if is_meant {
            id = Some(word);
            arguments.push(word);
        } else if let Some(found) = found {
            if let Some((option, None)) = found {
                open = option.filter(|option| !option.is_require_equals_set());
            }
            before.push(word);
        } else if let Some(sub) = current.find_subcommand(word) {
            current = sub;
            before.push(word);
        } else {
            arguments.push(word);
        }
    }
    let id = id.filter(|_| !current.has_subcommands() && takes_names(current))?;
    Some(format!(
        "if {id} is an id, write -- before it, and options before that, as in: mocban {} -- {}",
        quoted(&before),
        quoted(&arguments)
    ))
}

/// Returns whether an unknown option may have been found in a word. In a word such as `-va1`, the letter that no option has
/// stands behind others.
fn has_option(word: &str, option: &str) -> bool {
    if word.starts_with("--") {
        word.starts_with(option)
    } else {
        word.contains(option.trim_start_matches('-'))
    }
}

/// Returns words as they are typed into a shell, without the passwords of addresses.
fn quoted(words: &[&str]) -> String {
    let quoted = words.iter().map(|word| {
        if is_address(word) {
            shell_quoted(&without_password(word))
        } else {
            shell_quoted(word)
        }
    });
    quoted.collect::<Vec<_>>().join(" ")
}
