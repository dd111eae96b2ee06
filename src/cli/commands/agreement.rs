//! `agreement`: how reliable the reviewers are.

use crate::cli::output::context::Context;
use mocban_core::domain::PairName;
use mocban_project::{ExitCode, ProjectResult};
use mocban_report::agreement_text;
use mocban_results as results;

/// Number of pairs in conflict that are named.
const SHOWN_PAIRS: usize = 20;

pub(crate) async fn agreement(context: &Context) -> ProjectResult<ExitCode> {
    let (_project, catalog) = context.location.open_read_only().await?;
    let found = results::agreement(&catalog).await?;
    catalog.close().await;
    context.warn_about_set_apart(&found.set_apart);
    context.print(&found, || agreement_text(&found))?;
    if found.conflicts > 0 {
        context.info(&conflicts_text(&found.conflicting_pairs));
        context.info("a person who did not judge these results settles them (put that person's name for NAME):");
        for command in [
            "review --adjudicate --reviewer NAME",
            "verdict set PAIR pass --adjudicate --reviewer NAME",
        ] {
            context.info(&format!("  {}", context.command(command)));
        }
    }
    Ok(ExitCode::Done)
}

/// Names the first pairs in conflict.
fn conflicts_text(pairs: &[PairName]) -> String {
    let shown = pairs.iter().take(SHOWN_PAIRS).map(ToString::to_string);
    let mut parts = vec![shown.collect::<Vec<_>>().join(", ")];
    if let Some(more @ 1..) = pairs.len().checked_sub(SHOWN_PAIRS) {
        parts.push(format!("and {more} more (`agreement --json` names all)"));
    }
    format!("pairs in conflict: {}", parts.join(" "))
}

#[cfg(test)]
mod tests {
    use super::{SHOWN_PAIRS, conflicts_text};
    use mocban_core::domain::PairName;

    #[test]
    fn the_first_pairs_in_conflict_are_named() {
        let names = |number: usize| -> Vec<PairName> {
            let names = (0..number).map(|i| format!("p{i}").parse());
            names.collect::<Result<_, _>>().expect("valid ids")
        };
        assert_eq!(conflicts_text(&names(2)), "pairs in conflict: p0, p1");
        let all = conflicts_text(&names(SHOWN_PAIRS));
        assert!(all.ends_with(", p19"), "{all}");
        let more = conflicts_text(&names(SHOWN_PAIRS + 3));
        assert!(
            more.ends_with(", p19 and 3 more (`agreement --json` names all)"),
            "{more}"
        );
    }
}
