//! Examples in the help of each command, and the help without global options.

use clap::Command;

/// Commands with an example each. Two lines are two examples.
const EXAMPLES: [(&str, &str); 32] = [
    ("app", "mocban app\nmocban app blocks"),
    (
        "demo",
        "mocban demo\nmocban demo trial --tier hard --pairs 100\nmocban demo whole --block",
    ),
    (
        "align",
        "mocban align 0117.stl 0117.png\nmocban align 0117.stl 0117.png -o aligned",
    ),
    (
        "import",
        "mocban -C blocks import pairs.csv\nmocban -C blocks import --meshes stl --prints print --unit mm",
    ),
    (
        "run",
        "mocban -C blocks run\nmocban -C blocks run --dry-run",
    ),
    (
        "plan",
        "mocban -C blocks --catalog postgres://me@db.example/lab plan",
    ),
    (
        "worker",
        "mocban -C blocks --catalog postgres://me@db.example/lab worker --jobs 8",
    ),
    (
        "status",
        "mocban -C blocks status --watch\nmocban -C blocks status --pairs\nmocban -C blocks status --hosts",
    ),
    (
        "show",
        "mocban -C blocks show b01-0117\nmocban -C blocks show --low",
    ),
    ("retry", "mocban -C blocks retry --class io"),
    (
        "retire",
        "mocban -C blocks retire b01-0117\nmocban -C blocks retire --undo b01-0117\nmocban -C blocks retire b02",
    ),
    ("check", "mocban -C blocks check --repair"),
    ("backup", "mocban -C blocks backup blocks.sqlite"),
    (
        "restore",
        "mocban restore blocks.sqlite again --inputs /data/scans",
    ),
    ("copy", "mocban copy blocks postgres://me@db.example/lab"),
    (
        "db",
        "mocban db init --catalog postgres://me@db.example/lab --roles",
    ),
    (
        "db init",
        "mocban db init --catalog postgres://me@db.example/lab --roles\nmocban db init --roles --print-sql",
    ),
    ("verdict", "mocban -C blocks verdict log"),
    (
        "verdict set",
        "mocban -C blocks verdict set b01-0117 fail --reviewer lan --reason angle",
    ),
    (
        "verdict import",
        "mocban -C blocks verdict import verdicts.csv",
    ),
    ("verdict log", "mocban -C blocks verdict log b01-0117"),
    (
        "verdict undo",
        "mocban -C blocks verdict undo --reviewer lan",
    ),
    (
        "review",
        "mocban -C blocks review --reviewer lan\nmocban -C blocks review --reviewer minh --sample 100 --lang vi",
    ),
    ("agreement", "mocban -C blocks agreement"),
    (
        "report",
        "mocban -C blocks report\nmocban -C blocks report --format html -o report.html",
    ),
    (
        "export",
        "mocban -C blocks export -o out\nmocban -C blocks export --to csv,webdataset --split 80/10/10 -o dataset",
    ),
    (
        "view",
        "mocban -C blocks view b01-0117\nmocban -C blocks view notes-1",
    ),
    (
        "contact-sheet",
        "mocban -C blocks contact-sheet --order confidence -o worst.png\nmocban -C blocks contact-sheet --block notes-1 --overlay -o overlay.png",
    ),
    ("config", "mocban -C blocks config show"),
    ("completions", "mocban completions bash"),
    ("docs", "mocban docs"),
    ("man", "mocban man pages"),
];

/// Where the global options are described.
const GLOBAL: &str = "Global options, such as -C DIR and --json, are listed by mocban --help.";

/// Adds the examples to the help of all commands.
pub(crate) fn with_examples(command: Command) -> Command {
    add(command, "")
}

fn add(command: Command, path: &str) -> Command {
    let command = match EXAMPLES.iter().find(|(name, _)| *name == path) {
        Some((_, lines)) => command.after_help(format!(
            "Example{}:\n  {}",
            if lines.contains('\n') { "s" } else { "" },
            lines.replace('\n', "\n  ")
        )),
        None => command,
    };
    command.mut_subcommands(|sub| {
        let path = format!("{path} {}", sub.get_name());
        add(sub, path.trim())
    })
}

/// Hides the global options in the help of each command, and names the help that lists them.
pub(crate) fn without_global_options(mut command: Command) -> Command {
    // Passes the global options on to the commands.
    command.build();
    let globals: Vec<_> = command
        .get_arguments()
        .filter(|arg| arg.is_global_set())
        .map(|arg| arg.get_id().clone())
        .collect();
    command.mut_subcommands(|sub| hide(sub, &globals))
}

fn hide(command: Command, globals: &[clap::Id]) -> Command {
    let help = match command.get_after_help() {
        Some(examples) => format!("{examples}\n\n{GLOBAL}"),
        None => GLOBAL.to_owned(),
    };
    let command = command.mut_args(|arg| {
        let is_global = globals.contains(arg.get_id());
        if is_global { arg.hide(true) } else { arg }
    });
    command
        .after_help(help)
        .mut_subcommands(|sub| hide(sub, globals))
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;
    use std::path::{Path, PathBuf};

    use super::EXAMPLES;
    use crate::cli::args;

    #[test]
    fn every_command_has_examples_that_parse() {
        let command = args::command();
        let mut paths: Vec<String> = Vec::new();
        for sub in command.get_subcommands() {
            paths.push(sub.get_name().to_owned());
            let inner = sub.get_subcommands();
            paths.extend(inner.map(|inner| format!("{} {}", sub.get_name(), inner.get_name())));
        }
        paths.retain(|path| path != "help" && path != "config show");
        paths.sort();
        let mut named: Vec<&str> = EXAMPLES.iter().map(|(name, _)| *name).collect();
        named.sort_unstable();
        assert_eq!(named, paths);
        for (name, lines) in EXAMPLES {
            for line in lines.lines() {
                let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
                assert!(args::parse(&words).is_ok(), "{line}");
                assert!(line.contains(&format!(" {name}")), "{line}");
            }
        }
    }

    /// Splits a line of a shell into words, without its comment. Only quotes are known.
    fn words(line: &str) -> Vec<String> {
        let line = line.split(" #").next().unwrap_or_default();
        let parts = line
            .split('"')
            .enumerate()
            .flat_map(|(i, part)| match i % 2 {
                0 => part.split_whitespace().map(str::to_owned).collect(),
                _ => vec![part.to_owned()],
            });
        parts.collect()
    }

    #[test]
    fn commands_of_the_documentation_parse() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        // A test of the documentation checks that the book lists every page.
        let book = include_str!("../../../docs/SUMMARY.md").lines();
        let pages = book.filter_map(|line| line.split_once("](")?.1.strip_suffix(')'));
        let mut files: Vec<PathBuf> = pages.map(|page| root.join("docs").join(page)).collect();
        files.extend(["README.md", "CONTRIBUTING.md"].map(|name| root.join(name)));
        let mut count = 0;
        for file in files {
            let text = std::fs::read_to_string(&file).expect("UTF-8");
            let text = text.replace("cargo run --release -- ", "mocban ");
            let commands = text.lines().flat_map(|line| line.split(" && "));
            for line in commands.filter(|line| line.starts_with("mocban ")) {
                let words: Vec<_> = words(line).into_iter().map(OsString::from).collect();
                let parsed = args::parse(&words)
                    .map(drop)
                    .map_err(|error| error.to_string());
                assert_eq!(parsed, Ok(()), "{}: {line}", file.display());
                count += 1;
            }
        }
        assert!(count > 60, "{count} commands");
    }

    #[test]
    fn help_of_commands_names_no_global_option() {
        for command in ["run", "verdict"] {
            let words = ["mocban", command, "--help"].map(OsString::from);
            let help = args::parse(&words).expect_err("the help").to_string();
            assert!(!help.contains("--log-format"), "{help}");
            assert!(help.contains("mocban --help"), "{help}");
            assert!(help.contains("Example"), "{help}");
        }
        let all = ["mocban", "--help"].map(OsString::from);
        let help = args::parse(&all).expect_err("the help").to_string();
        assert!(help.contains("--log-format"), "{help}");
    }
}
