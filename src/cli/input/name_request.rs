//! Which names a shell may complete at the end of an unfinished command line.

use clap::{Arg, Command};

/// Ids of the arguments that are pairs or blocks.
pub(crate) const PAIR_ARGUMENTS: [&str; 4] = ["pair", "pairs", "name", "names"];
/// Id of the arguments that are blocks.
const BLOCK_ARGUMENT: &str = "block";
/// Commands in which arguments with these ids are new names.
const WITH_NEW_NAMES: [&str; 2] = ["import", "demo"];

/// A name that may be completed, and the project that has it.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct NameRequest {
    /// The beginning of the name.
    pub(crate) prefix: String,
    /// Only blocks, not pairs.
    pub(crate) is_block: bool,
    /// Value of `-C`.
    pub(crate) directory: Option<String>,
    /// Value of `--catalog`.
    pub(crate) catalog: Option<String>,
    /// Value of `--config`.
    pub(crate) config: Option<String>,
}

impl NameRequest {
    /// Returns the name that the last word begins, or `None` if it is no name. `command` is the program, after `Command::build`, and
    /// `words` the command line without its name, as the shell has it: with quotes and backslashes.
    pub(crate) fn of(command: &Command, words: &[String]) -> Option<Self> {
        let words: Vec<String> = words.iter().map(|word| unquoted(word)).collect();
        let (last, before) = words.split_last()?;
        let (mut current, mut positional) = (command, 0);
        let mut request = Self {
            prefix: last.clone(),
            ..Self::default()
        };
        // The option whose value the next word is.
        let mut open: Option<&Arg> = None;
        for word in before {
            if let Some(option) = open.take() {
                request.keep(option, word);
            } else if word.starts_with('-') && word.len() > 1 {
                let (option, value) = find_option(current, word)?;
                match (option, value) {
                    (Some(option), Some(value)) => request.keep(option, &value),
                    (option, None) => open = option,
                    (None, Some(_)) => {}
                }
            } else if let Some(sub) = current.find_subcommand(word) {
                (current, positional) = (sub, 0);
            } else {
                positional += 1;
            }
        }
        if WITH_NEW_NAMES.contains(&current.get_name()) {
            return None;
        }
        if let Some(option) = open {
            request.is_block = true;
            return (option.get_id() == BLOCK_ARGUMENT).then_some(request);
        }
        let argument = positional_at(current, positional)?;
        let is_name = PAIR_ARGUMENTS.contains(&argument.get_id().as_str());
        (is_name && !last.starts_with('-')).then_some(request)
    }

    fn keep(&mut self, option: &Arg, value: &str) {
        let place = match option.get_id().as_str() {
            "directory" => &mut self.directory,
            "catalog" => &mut self.catalog,
            "config" => &mut self.config,
            _ => return,
        };
        *place = Some(value.to_owned());
    }
}

/// Returns whether a command, or one of its subcommands, has arguments that are pairs or blocks.
pub(crate) fn takes_names(command: &Command) -> bool {
    let is_name = |arg: &Arg| PAIR_ARGUMENTS.contains(&arg.get_id().as_str());
    !WITH_NEW_NAMES.contains(&command.get_name())
        && (command.get_positionals().any(is_name) || command.get_subcommands().any(takes_names))
}

/// Returns whether a command has an option that is a block.
pub(crate) fn has_block_option(command: &Command) -> bool {
    let is_block = |arg: &Arg| arg.get_id() == BLOCK_ARGUMENT;
    !WITH_NEW_NAMES.contains(&command.get_name()) && command.get_opts().any(is_block)
}

/// Returns the option of a word that takes a value, and the value if the word has it too. Returns `None` for an unknown
/// option.
pub(crate) fn find_option<'a>(
    command: &'a Command,
    word: &str,
) -> Option<(Option<&'a Arg>, Option<String>)> {
    let takes_value = |arg: &&Arg| arg.get_action().takes_values();
    if let Some(long) = word.strip_prefix("--") {
        let (name, value) = match long.split_once('=') {
            Some((name, value)) => (name, Some(value.to_owned())),
            None => (long, None),
        };
        let is_it = |arg: &&Arg| {
            let aliases = arg.get_all_aliases().unwrap_or_default();
            arg.get_long() == Some(name) || aliases.contains(&name)
        };
        let option = command.get_arguments().find(is_it)?;
        return Some((Some(option).filter(takes_value), value));
    }
    for (at, letter) in word.char_indices().skip(1) {
        let mut all = command.get_arguments();
        let option = all.find(|arg| arg.get_short() == Some(letter))?;
        if takes_value(&option) {
            let rest = &word[at + letter.len_utf8()..];
            return Some((Some(option), (!rest.is_empty()).then(|| rest.to_owned())));
        }
    }
    Some((None, None))
}

/// Returns a positional argument; the last one may take many words.
fn positional_at(command: &Command, at: usize) -> Option<&Arg> {
    let all: Vec<&Arg> = command.get_positionals().collect();
    let last = all
        .last()
        .filter(|arg| arg.get_action().takes_values() && is_many(arg));
    all.get(at).or(last).copied()
}

fn is_many(arg: &Arg) -> bool {
    matches!(arg.get_action(), clap::ArgAction::Append)
}

/// Removes the quotes and backslashes of a shell.
fn unquoted(word: &str) -> String {
    let (mut text, mut quote) = (String::new(), None);
    let mut letters = word.chars();
    while let Some(letter) = letters.next() {
        match (letter, quote) {
            ('\'' | '"', None) => quote = Some(letter),
            (letter, Some(open)) if letter == open => quote = None,
            ('\\', None | Some('"')) => text.extend(letters.next()),
            (letter, _) => text.push(letter),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::NameRequest;
    use crate::cli::args;

    fn request(line: &str) -> Option<NameRequest> {
        let mut command = args::command();
        command.build();
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        NameRequest::of(&command, &words)
    }

    #[test]
    fn names_follow_the_commands_that_take_them() {
        for line in [
            "show b0",
            "-C blocks show b0",
            "-Cblocks --json view --metric relief b0",
            "run b1 b0",
            "retry b0",
            "retire b0",
            "retire --undo b0",
            "plan b0",
            "sheet b0",
            "verdict set b0",
            "verdict log b0",
        ] {
            let found = request(line).unwrap_or_else(|| panic!("{line}"));
            assert_eq!(
                (found.prefix.as_str(), found.is_block),
                ("b0", false),
                "{line}"
            );
            let is_elsewhere = line.contains("blocks");
            assert_eq!(found.directory.is_some(), is_elsewhere, "{line}");
        }
        let block = request("contact-sheet --block ").expect("a block");
        assert!(block.is_block && block.prefix.is_empty());
    }

    #[test]
    fn other_words_are_no_names() {
        for line in [
            "sho",
            "show --lo",
            "show b0 b1",
            "view --metric r",
            "-C bl",
            "report b",
            "import --name b",
            "demo d",
            "verdict set b0 pa",
            "show --unknown b",
        ] {
            assert_eq!(request(line), None, "{line}");
        }
    }

    #[test]
    fn quotes_and_backslashes_of_the_shell_are_removed() {
        let words = ["-C", "'khối 4'", "show", r"chữ\ số"].map(str::to_owned);
        let mut command = args::command();
        command.build();
        let found = NameRequest::of(&command, &words).expect("a name");
        assert_eq!(found.prefix, "chữ số");
        assert_eq!(found.directory.as_deref(), Some("khối 4"));
    }
}
