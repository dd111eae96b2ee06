//! A run with another method than before replaces the results, and says so before it computes.

use crate::check::sql;
use crate::cli::mocban;
use crate::page::read_project;
use crate::snapshots::assert_call;

/// The sentence of `run`.
const SENTENCE: &str = "this run replaces the results of the other method; to keep both, stop it now, import the pairs into a second project, and compare the two with `report --compare`";

#[test]
fn a_run_with_another_method_says_that_two_methods_want_two_projects() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let paper = ["-C", "p", "--config", "paper", "run"];
    assert_call(
        "run_dry_run_other_method",
        dir.path(),
        &[&paper[..], &["--dry-run"]].concat(),
    );
    let pair = ["--progress", "none", "upright-0000"];
    let run = mocban(dir.path(), &[&paper[..], &pair].concat());
    assert!(
        run.err.contains(&format!("warning: {SENTENCE}")),
        "{}",
        run.err
    );
    // It says so before it says what it did.
    assert!(
        run.err.find(SENTENCE) < run.err.find(" done, "),
        "{}",
        run.err
    );
    let again = mocban(dir.path(), &[&paper[..], &pair].concat());
    assert!(!again.err.contains(SENTENCE), "{}", again.err);
}

#[test]
fn a_report_shows_the_results_of_low_confidence_by_name_the_lowest_first() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    // All other results are sure.
    for (pair, confidence) in [
        ("", 0.9),
        ("upright-0002", 0.3),
        ("upright-0007", 0.1),
        ("upright-0011", 0.4),
    ] {
        let pairs = format!("(SELECT id FROM pair WHERE name = '{pair}' OR '{pair}' = '')");
        sql(
            &project,
            &format!(
                "UPDATE metric_result SET confidence = {confidence} WHERE metric = 'ensemble' AND pair IN {pairs};
                UPDATE stage_result SET outcome = json_set(outcome, (SELECT fullkey || '.confidence' FROM
                json_each(outcome, '$.metrics') WHERE value ->> 'metric' = 'ensemble'), {confidence})
                WHERE json_type(outcome, '$.metrics') = 'array' AND pair IN {pairs};"
            ),
        );
    }
    let args = ["-C", "p", "report", "--format", "html", "-o", "report.html"];
    mocban(dir.path(), &args).expect(0);
    let page = std::fs::read_to_string(dir.path().join("report.html")).expect("a report");
    let group = page
        .split("id=\"images-low-confidence\"")
        .nth(1)
        .expect("the group");
    let group = group.split("<h3").next().expect("its content");
    assert!(group.contains(" 3 of 3 are shown"), "{}", &group[..400]);
    let names = group.split("<figcaption><strong>").skip(1);
    let names: Vec<&str> = names.filter_map(|rest| rest.split('<').next()).collect();
    assert_eq!(names, ["upright-0007", "upright-0002", "upright-0011"]);
    assert_eq!(
        group.matches("src=\"data:image/jpeg").count(),
        9,
        "three pictures each"
    );
}
