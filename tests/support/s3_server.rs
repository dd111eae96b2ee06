//! An S3-compatible server (`SeaweedFS`) for tests, and a proxy before it that loses requests.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Once};
use std::time::Duration;

use futures_util::TryStreamExt as _;
use object_store::aws::AmazonS3Builder;
use object_store::path::Path as Key;
use object_store::{ObjectStore as _, ObjectStoreExt as _, PutPayload};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Bucket of the tests.
const BUCKET: &str = "mocban";

/// A running server with an empty bucket. It ends with this value.
#[derive(Debug)]
pub(crate) struct S3Server {
    process: Child,
    port: u16,
    _dir: tempfile::TempDir,
}

impl S3Server {
    /// Starts a server. Returns `None`, and prints why once, if none is installed.
    pub(crate) fn start() -> Option<Self> {
        static SKIPPED: Once = Once::new();
        let Some(program) = program() else {
            let text =
                "skipped: SeaweedFS (weed) is not installed, so no test uses an object store\n";
            SKIPPED.call_once(|| drop(std::io::stderr().write_all(text.as_bytes())));
            return None;
        };
        // Another process may use a port.
        (0..5).find_map(|_| Self::try_start(&program))
    }

    fn try_start(program: &Path) -> Option<Self> {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [master, volume, filer, port] = own_ports();
        // Without these arguments, each part also listens on its port + 10000, which may be in use.
        let [grpc_master, grpc_volume, grpc_filer, grpc_s3] = own_ports();
        let process = Command::new(program)
            .args([
                "server",
                "-s3",
                "-s3.port.iceberg=0",
                "-s3.port.lance=0",
                "-ip=127.0.0.1",
                "-volume.max=10",
                // A disk that is nearly full would make it refuse all objects.
                "-volume.minFreeSpace=1MiB",
                "-master.telemetry=false",
            ])
            .args([
                "-master.volumeSizeLimitMB=64",
                "-master.volumePreallocate=false",
            ])
            .arg(format!("-dir={}", dir.path().display()))
            .args([
                format!("-master.port={master}"),
                format!("-master.port.grpc={grpc_master}"),
            ])
            .args([
                format!("-volume.port={volume}"),
                format!("-volume.port.grpc={grpc_volume}"),
            ])
            .args([
                format!("-filer.port={filer}"),
                format!("-filer.port.grpc={grpc_filer}"),
            ])
            .args([
                format!("-s3.port={port}"),
                format!("-s3.port.grpc={grpc_s3}"),
            ])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the server starts");
        let mut server = Self {
            process,
            port,
            _dir: dir,
        };
        // An object with a body is stored when all parts of the server have found each other.
        let deadline = std::time::Instant::now() + Duration::from_mins(5);
        while std::time::Instant::now() < deadline {
            if server.process.try_wait().expect("its state").is_some() {
                return None;
            }
            if request(port, "PUT", &format!("/{BUCKET}"), "") == Some(200)
                && request(port, "PUT", &format!("/{BUCKET}/ready"), "ready") == Some(200)
            {
                request(port, "DELETE", &format!("/{BUCKET}/ready"), "");
                return Some(server);
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        None
    }

    /// Returns the port of the S3 interface.
    pub(crate) const fn port(&self) -> u16 {
        self.port
    }

    /// Sets the variables with which a command uses the server at a port, its own or that of a proxy.
    pub(crate) fn configure(command: &mut Command, port: u16) {
        command
            .env("AWS_ENDPOINT_URL", format!("http://127.0.0.1:{port}"))
            .env("AWS_ACCESS_KEY_ID", "test")
            .env("AWS_SECRET_ACCESS_KEY", "secret-of-the-test")
            .env("AWS_REGION", "us-east-1");
    }

    fn bucket(&self) -> impl object_store::ObjectStore + use<> {
        let _ = rustls::crypto::ring::default_provider().install_default();
        AmazonS3Builder::new()
            .with_endpoint(format!("http://127.0.0.1:{}", self.port))
            .with_allow_http(true)
            .with_bucket_name(BUCKET)
            .with_access_key_id("test")
            .with_secret_access_key("test")
            .with_region("us-east-1")
            .build()
            .expect("a client")
    }

    /// Stores the files of a folder, with their subfolders, below a prefix.
    pub(crate) fn upload(&self, folder: &Path, prefix: &str) {
        let files = crate::uninterrupted::files(folder);
        let bucket = self.bucket();
        wait(async {
            for (path, bytes) in files {
                let path = path.to_string_lossy().replace('\\', "/");
                let key = Key::parse(format!("{prefix}/{path}")).expect("a key");
                let stored = bucket.put(&key, PutPayload::from(bytes)).await;
                stored.expect("stored");
            }
        });
    }

    /// Returns the keys below a prefix.
    pub(crate) fn list(&self, prefix: &str) -> Vec<String> {
        let bucket = self.bucket();
        wait(async {
            let prefix = Key::from(prefix);
            let found = bucket
                .list(Some(&prefix))
                .map_ok(|meta| meta.location.to_string());
            let mut found: Vec<_> = found.try_collect().await.expect("listed");
            found.sort();
            found
        })
    }

    /// Removes an object.
    pub(crate) fn remove(&self, key: &str) {
        let bucket = self.bucket();
        wait(async { bucket.delete(&Key::from(key)).await.expect("removed") });
    }
}

impl Drop for S3Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn wait<T>(future: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    runtime.expect("a runtime").block_on(future)
}

/// Returns the program that `MOCBAN_WEED` or `PATH` names.
fn program() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("MOCBAN_WEED") {
        return Some(given.into());
    }
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join("weed"))
        .find(|file| file.is_file())
}

fn own_ports() -> [u16; 4] {
    [(); 4].map(|()| crate::own_port::own_port())
}

/// Sends a request. Returns the status of the reply.
fn request(port: u16, method: &str, path: &str, body: &str) -> Option<u16> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    stream.set_read_timeout(Some(Duration::from_mins(2))).ok()?;
    let length = body.len();
    let request = format!(
        "{method} {path} HTTP/1.1\r\nHost: s3\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
    );
    stream.write_all(request.as_bytes()).ok()?;
    let mut reply = String::new();
    stream.read_to_string(&mut reply).ok()?;
    reply.split(' ').nth(1)?.parse().ok()
}

/// How often a proxy disturbs requests, in percent.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Faults {
    /// Answered with 503.
    pub(crate) refused: u32,
    /// Carried out, but the reply is lost.
    pub(crate) lost: u32,
    /// Delayed by a second.
    pub(crate) slow: u32,
}

/// An outage of the store behind a proxy: all requests lose their connection.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outage {
    begins_at_put: Arc<AtomicBool>,
    is_away: Arc<AtomicBool>,
}

impl Outage {
    /// Begins at the next `PUT` request, which is lost too.
    pub(crate) fn begin_at_put(&self) {
        self.begins_at_put.store(true, Ordering::SeqCst);
    }

    /// Returns whether it has begun.
    #[allow(dead_code, reason = "not every test binary waits for an outage")]
    pub(crate) fn has_begun(&self) -> bool {
        self.is_away.load(Ordering::SeqCst)
    }

    /// Ends.
    pub(crate) fn end(&self) {
        self.is_away.store(false, Ordering::SeqCst);
    }

    /// Returns whether a request is lost.
    fn takes(&self, request: &[u8]) -> bool {
        if request.starts_with(b"PUT") && self.begins_at_put.swap(false, Ordering::SeqCst) {
            self.is_away.store(true, Ordering::SeqCst);
        }
        self.is_away.load(Ordering::SeqCst)
    }
}

/// Numbers of requests that a proxy has passed on, by method.
#[derive(Debug, Default)]
pub(crate) struct Requests {
    /// `PUT` requests.
    pub(crate) put: AtomicU64,
    /// `GET` requests, lists included.
    pub(crate) get: AtomicU64,
    /// Disturbed requests.
    pub(crate) disturbed: AtomicU64,
}

/// Starts a proxy. It ends with this process.
pub(crate) fn proxy(server: u16, faults: Faults) -> (u16, Arc<Requests>) {
    proxy_with_outage(server, faults, &Outage::default())
}

/// Starts a proxy to a store with an outage. It ends with this process.
pub(crate) fn proxy_with_outage(
    server: u16,
    faults: Faults,
    outage: &Outage,
) -> (u16, Arc<Requests>) {
    let outage = outage.clone();
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let requests = Arc::new(Requests::default());
    let counted = Arc::clone(&requests);
    let dice = Arc::new(Mutex::new(ChaCha8Rng::seed_from_u64(7)));
    std::thread::spawn(move || {
        for client in listener.incoming().flatten() {
            let (counted, dice) = (Arc::clone(&counted), Arc::clone(&dice));
            let outage = outage.clone();
            std::thread::spawn(move || {
                let roll = || dice.lock().expect("no panic").random_range(0..100_u32);
                // An error ends the connection, as the client expects of a bad network.
                let _ = serve(client, server, (faults, &outage), &counted, roll);
            });
        }
    });
    (port, requests)
}

/// Passes on one request, and closes the connection.
fn serve(
    mut client: TcpStream,
    server: u16,
    (faults, outage): (Faults, &Outage),
    counted: &Requests,
    roll: impl Fn() -> u32,
) -> std::io::Result<()> {
    let request = read_request(&mut client)?;
    if outage.takes(&request) {
        return Ok(());
    }
    let dice = roll();
    if dice < faults.refused {
        counted.disturbed.fetch_add(1, Ordering::Relaxed);
        let reply = "HTTP/1.1 503 Slow Down\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
        client.write_all(reply.as_bytes())?;
        return client.shutdown(Shutdown::Write);
    }
    let method = if request.starts_with(b"PUT") {
        Some(&counted.put)
    } else if request.starts_with(b"GET") {
        Some(&counted.get)
    } else {
        None
    };
    if let Some(count) = method {
        count.fetch_add(1, Ordering::Relaxed);
    }
    let mut forward = TcpStream::connect(("127.0.0.1", server))?;
    forward.write_all(&request)?;
    let mut reply = Vec::new();
    forward.read_to_end(&mut reply)?;
    if dice < faults.refused + faults.lost {
        counted.disturbed.fetch_add(1, Ordering::Relaxed);
        return Ok(());
    }
    if dice < faults.refused + faults.lost + faults.slow {
        counted.disturbed.fetch_add(1, Ordering::Relaxed);
        std::thread::sleep(Duration::from_secs(1));
    }
    client.write_all(&reply)?;
    client.shutdown(Shutdown::Write)
}

/// Reads a request with its body, and asks the server to close the connection after the reply.
fn read_request(client: &mut TcpStream) -> std::io::Result<Vec<u8>> {
    let mut request = Vec::new();
    let mut chunk = [0; 1 << 14];
    let end = loop {
        let count = client.read(&mut chunk)?;
        if count == 0 {
            return Err(std::io::ErrorKind::UnexpectedEof.into());
        }
        request.extend_from_slice(&chunk[..count]);
        if let Some(end) = request.windows(4).position(|four| four == b"\r\n\r\n") {
            break end;
        }
    };
    let head = String::from_utf8_lossy(&request[..end]).to_lowercase();
    let length = head
        .lines()
        .find_map(|line| line.strip_prefix("content-length:"))
        .map_or(0, |value| value.trim().parse().unwrap_or(0_usize));
    let mut body = request.split_off(end + 4);
    while body.len() < length {
        let count = client.read(&mut chunk)?;
        if count == 0 {
            return Err(std::io::ErrorKind::UnexpectedEof.into());
        }
        body.extend_from_slice(&chunk[..count]);
    }
    request.truncate(end);
    request.extend_from_slice(b"\r\nConnection: close\r\n\r\n");
    request.extend(body);
    Ok(request)
}
