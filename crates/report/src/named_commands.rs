//! Commands in sentences of the report, and what readers without a terminal see in their place.

/// A page of the app that does what a command does, or shows what it prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandPage {
    /// The list of retired pairs.
    Retired,
    /// The page of imports.
    Import,
    /// The page of runs.
    Run,
    /// The failed pairs, which the report has itself.
    Failures,
    /// The page of reviews.
    Review,
    /// The page of checks.
    Health,
}

/// A command in a sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NamedCommand {
    /// The end of the sentence, which names the command.
    pub clause: &'static str,
    /// What stands there for readers without a terminal.
    pub without: &'static str,
    /// The page of the app.
    pub page: CommandPage,
}

/// All commands in sentences.
pub const NAMED_COMMANDS: [NamedCommand; 6] = [
    NamedCommand {
        clause: "; `mocban status --retired` says why.",
        without: ". In the app, the page Pairs has the reason.",
        page: CommandPage::Retired,
    },
    NamedCommand {
        clause: "; `mocban import` adds them.",
        without: ". In the app, the page Import adds them.",
        page: CommandPage::Import,
    },
    NamedCommand {
        clause: "; `mocban run` continues the work.",
        without: ". In the app, the page Run continues the work.",
        page: CommandPage::Run,
    },
    NamedCommand {
        clause: "; `mocban status` lists the reasons.",
        without: ". Failed pairs are listed below with their reasons.",
        page: CommandPage::Failures,
    },
    NamedCommand {
        clause: " (`mocban review --reviewer NAME` starts judging).",
        without: ". In the app, results are judged on the page Review.",
        page: CommandPage::Review,
    },
    NamedCommand {
        clause: "; `check` lists them.",
        without: ". In the app, the page Health lists them.",
        page: CommandPage::Health,
    },
];

/// Returns the page of the app for the command in a text, if there is one.
pub fn command_page(text: &str) -> Option<CommandPage> {
    let mut known = NAMED_COMMANDS.iter();
    let found = known.find(|command| text.contains(command.clause))?;
    Some(found.page)
}

/// Returns a text that says what to do without a command.
pub(super) fn without_named_commands(text: &str) -> String {
    let known = NAMED_COMMANDS.iter();
    known.fold(text.to_owned(), |text, command| {
        text.replace(command.clause, command.without)
    })
}

#[cfg(test)]
mod tests {
    use super::{NAMED_COMMANDS, command_page, without_named_commands};
    use crate::{ReportAccumulator, test_fixtures};
    use mocban_catalog::SetApart;
    use mocban_core::domain::FailureClass;
    use mocban_results::TruthEvaluation;

    /// Returns the sentences of reports that name a command.
    fn sentences() -> Vec<String> {
        let failed = test_fixtures::failed("a", FailureClass::Io, "gone");
        let done = test_fixtures::done("a", 0.75, &[]);
        let mut texts = Vec::new();
        for (pair, retired) in [
            (None, 0),
            (None, 2),
            (Some(test_fixtures::pending("a")), 0),
            (Some(failed), 0),
            (Some(done), 0),
        ] {
            let mut report = ReportAccumulator::default();
            report.set_retired(retired);
            if let Some(pair) = pair {
                report.add(&pair, &TruthEvaluation::default());
            }
            let report = report.finish();
            let said = report.headline.iter().chain(&report.warnings);
            texts.extend(said.map(ToString::to_string));
        }
        let set_apart = SetApart {
            count: 1,
            first: vec!["row 3".to_owned()],
        };
        texts.push(set_apart.sentence().expect("a row") + ".");
        texts.retain(|text| text.contains('`'));
        texts
    }

    #[test]
    fn every_command_in_a_sentence_has_its_page_and_other_words() {
        let sentences = sentences();
        for sentence in &sentences {
            let known = NAMED_COMMANDS
                .iter()
                .filter(|command| sentence.contains(command.clause));
            assert_eq!(known.count(), 1, "{sentence}");
            let plain = without_named_commands(sentence);
            assert!(!plain.contains('`'), "{plain}");
        }
        for command in NAMED_COMMANDS {
            let mut said = sentences.iter();
            assert!(
                said.any(|text| command_page(text) == Some(command.page)),
                "{command:?}"
            );
        }
        assert_eq!(command_page("All 2 pairs are aligned."), None);
    }
}
