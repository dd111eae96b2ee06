//! Measures how long a browser waits for the first byte of each page of the app, in catalogs of many pairs.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::Context as _;

use super::markdown::Table;
use super::options::Options;
use super::process;
use super::scale::filled;
use super::spread::Spread;
use super::world::World;

/// Pairs that are run. The others get copies of the rows of one of them.
const WORKED: usize = 500;
/// Requests for each page, and for each part, which may take long.
const REQUESTS: [usize; 2] = [20, 2];
/// Most bytes that are read of the page with the session.
const SESSION_BYTES: u64 = 16_384;

const NOTE: &str = "\
Milliseconds from the connection to the first byte of a reply, median / 95th percentile of 20 requests, one after another, \
and of the first request for the page. A part is loaded by its page after the page is shown; its median is of 2 requests. MiB: peak \
memory of the app after the page.";

/// Pages below the project.
const PAGES: [(&str, &str); 23] = [
    ("Run, with the worst of the hour", ""),
    ("Pairs", "pairs"),
    ("Pairs, table", "pairs?view=table"),
    ("Pairs, aligned", "pairs?state=aligned"),
    ("Pairs, waiting", "pairs?state=waiting"),
    ("Pairs, failed", "pairs?state=failed"),
    (
        "Pairs, low confidence",
        "pairs?confidence=low&sort=confidence",
    ),
    ("Pairs, by confidence", "pairs?sort=confidence"),
    ("Pairs, highest IoU", "pairs?sort=iou-down&view=table"),
    ("Pairs, passed", "pairs?verdict=pass"),
    ("Pairs, not judged", "pairs?verdict=none"),
    ("Pairs, metrics differ", "pairs?compare=density&differs=0.3"),
    ("Pairs, no match", "pairs?block=nowhere"),
    ("Pairs, retired", "pairs?state=retired"),
    ("Pair", "pair/p00000001/"),
    ("Pair, two metrics", "pair/p00000001/?compare=density"),
    (
        "Unit of failed scans",
        "correct?what=unit&class=no_solution",
    ),
    ("Blocks", "blocks"),
    ("Review", "review"),
    ("Report", "report"),
    ("Export", "export"),
    (
        "Settings, a change",
        "settings?key=register.smoothing_px&value=1.3",
    ),
    ("Health", "health"),
];
/// Parts that pages load after they are shown.
const PARTS: [(&str, &str); 4] = [
    ("part: newest import", "last-import"),
    ("part: size of scans and prints", "health/inputs"),
    ("part: agreement", "review/agreement"),
    ("part: numbers of the report", "report/numbers"),
];

/// Views of the project, as many as can be saved.
const VIEWS: usize = 100;
/// Number of pairs in the list whose import is previewed.
const LISTED: usize = 200;

/// The app in a process of its own, with the session of a browser.
struct App {
    child: Child,
    host: String,
    session: String,
    cookie: String,
}

impl Drop for App {
    fn drop(&mut self) {
        // It has no work to finish.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Measures catalogs of the configured sizes; returns the table as text.
pub(super) async fn table(options: &Options) -> anyhow::Result<String> {
    let heads = ["pairs", "page", "first", "first byte", "MiB"];
    let mut table = Table::new("First byte of the pages of the app", &heads);
    for pairs in options.sizes() {
        let (world, _) = World::import(pairs)?;
        let catalog = world.catalog().await?;
        let (catalog, _) = filled(&world, catalog, pairs, WORKED).await?;
        catalog.close().await;
        prepare(&world)?;
        let app = App::start(&world)?;
        let project = world.project.dir().file_name().context("a name")?;
        let project = project.to_str().context("a name in UTF-8")?;
        let below = PAGES.iter().chain(&PARTS);
        let below = below.map(|(name, page)| (*name, format!("p/{project}/{page}")));
        let others = others(&world, project)?.into_iter();
        for (name, page) in others.chain(below) {
            let first = app.first_byte(&page)?;
            let mut spread = Spread::default();
            for _ in 0..REQUESTS[usize::from(name.starts_with("part"))] {
                spread.add(app.first_byte(&page)?);
            }
            let first = format!("{:.1}", first.as_secs_f64() * 1000.0);
            let mib = process::peak_mib(&app.child.id().to_string());
            let mib = format!("{:.0}", mib.unwrap_or(0.0));
            let cells = [
                pairs.to_string(),
                name.to_owned(),
                first,
                spread.cell(),
                mib,
            ];
            let _ = writeln!(std::io::stderr(), "{}", cells.join(" | "));
            table.push(cells.into());
        }
    }
    Ok(table.render(NOTE))
}

/// Saves views, retires pairs, and makes a backup and a list.
fn prepare(world: &World) -> anyhow::Result<()> {
    let dir = world.project.dir();
    let views = (0..VIEWS).map(|number| {
        serde_json::json!({ "name": format!("{number:02}"), "list": format!("block=b{number}") })
    });
    let views = serde_json::json!({ "views": views.collect::<Vec<_>>() });
    std::fs::write(dir.join("saved-views.json"), views.to_string())?;
    world.run(&["retire", "p00000002", "p00000003"])?;
    let backup = dir.join("backups/backup.sqlite");
    world.run(&["backup", backup.to_str().context("a path in UTF-8")?])?;
    let rows = (0..LISTED).map(|number| format!("p{number:08},mesh.stl,print.png\n"));
    let list = format!("id,mesh,print\n{}", rows.collect::<String>());
    std::fs::write(dir.join("listed.csv"), list)?;
    Ok(())
}

/// Returns pages and parts that are not below the project.
fn others(world: &World, project: &str) -> anyhow::Result<Vec<(&'static str, String)>> {
    let dir = world.project.dir().canonicalize()?;
    let dir = dir.to_str().context("a path in UTF-8")?;
    let list = format!("project={project}&list={dir}/listed.csv");
    Ok(vec![
        ("Home", String::new()),
        ("Import", "import".to_owned()),
        (
            "Import into the project",
            format!("import?project={project}"),
        ),
        ("Import of a list", format!("import?{list}")),
        ("Restore", "restore".to_owned()),
        ("part: headers of files", format!("import/files?{list}")),
        (
            "part: files that cannot be used",
            format!("import/problems?{list}"),
        ),
        (
            "part: content of a backup",
            format!("restore/content?backup={dir}/backups/backup.sqlite"),
        ),
    ])
}

impl App {
    /// Starts the app on a project and opens a session.
    fn start(world: &World) -> anyhow::Result<Self> {
        let mut child = Command::new(env!("CARGO_BIN_EXE_mocban"))
            .args(["--json", "app", "--no-open", "--lang", "en"])
            .arg(world.project.dir())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let mut line = String::new();
        BufReader::new(child.stdout.take().context("no pipe")?).read_line(&mut line)?;
        let message: serde_json::Value = serde_json::from_str(&line)?;
        let url = message["url"].as_str().context("no address")?;
        let (host, start) = url
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once('/'))
            .context("an address")?;
        let mut app = Self {
            child,
            host: host.to_owned(),
            session: String::new(),
            cookie: String::new(),
        };
        let mut page = String::new();
        let reply = app.request(&format!("/{start}"))?;
        reply.take(SESSION_BYTES).read_to_string(&mut page)?;
        let after = |mark: &str, end: char| {
            let rest = page.split(mark).nth(1)?;
            rest.split(end).next().map(str::to_owned)
        };
        app.cookie = after("set-cookie: ", ';').context("no cookie")?;
        let session = after("data-session=\"", '"').context("no session")?;
        session.trim_end_matches('/').clone_into(&mut app.session);
        Ok(app)
    }

    /// Asks for a path and returns the connection.
    fn request(&self, path: &str) -> anyhow::Result<TcpStream> {
        let mut stream = TcpStream::connect(&self.host)?;
        let head = format!(
            "GET {path} HTTP/1.1\r\nconnection: close\r\nhost: {}\r\ncookie: {}\r\naccept: text/html\r\n\r\n",
            self.host, self.cookie
        );
        stream.write_all(head.as_bytes())?;
        Ok(stream)
    }

    /// Returns the time until the first byte of a page, which must be shown.
    fn first_byte(&self, page: &str) -> anyhow::Result<Duration> {
        let start = Instant::now();
        let mut stream = self.request(&format!("{}/{page}", self.session))?;
        let mut head = [0; 12];
        stream.read_exact(&mut head[..1])?;
        let time = start.elapsed();
        stream.read_exact(&mut head[1..])?;
        let head = String::from_utf8_lossy(&head);
        anyhow::ensure!(head == "HTTP/1.1 200", "{page}: {head}");
        std::io::copy(&mut stream, &mut std::io::sink())?;
        Ok(time)
    }
}
