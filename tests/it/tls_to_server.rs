//! Encrypted connections to a database server whose certificate is wrong, or that has none.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::cli::{binary, call, empty};
use crate::own_port::own_port;
use crate::postgres_server::Server;
use crate::resume::project;
use crate::skipped::say_skipped;
use crate::waiting::PATIENT_CONNECT;

/// Longer than a busy machine needs, and shorter than the wait for a connection with [`PATIENT_CONNECT`].
const AT_ONCE: Duration = Duration::from_mins(5);

/// Creates an authority, a key, a certificate that the key signed itself, and certificates that the authority signed: a
/// valid one, an expired one and one for another host.
const SCRIPT: &str = "set -e
key='-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes'
openssl req -x509 $key -keyout ca.key -out ca.crt -subj /CN=authority -days 2
openssl req $key -keyout server.key -out server.csr -subj /CN=server
printf 'subjectAltName=DNS:localhost' >here.ext
printf 'subjectAltName=DNS:db.example' >elsewhere.ext
printf '[ca]\ndefault_ca=d\n[d]\ndatabase=list\nnew_certs_dir=.\nrand_serial=1\ndefault_md=sha256\npolicy=p\nunique_subject=no\n[p]\ncommonName=supplied\n' >ca.cnf
touch list
sign() {
    openssl ca -batch -config ca.cnf -cert ca.crt -keyfile ca.key -in server.csr -out $1.crt -extfile $2.ext -notext \
        -startdate 200101000000Z -enddate $3
}
sign good here 491231235959Z
sign expired here 200201000000Z
sign other elsewhere 491231235959Z
openssl x509 -req -in server.csr -signkey server.key -out self.crt -extfile here.ext -days 2
cp good.crt server.crt
chmod 600 server.key";

/// Writes the keys and certificates.
fn write_certificates(dir: &Path) {
    let mut script = Command::new("sh");
    let made = script.args(["-c", SCRIPT]).current_dir(dir).output();
    let made = made.expect("a shell");
    let text = String::from_utf8_lossy(&made.stderr);
    assert!(made.status.success(), "{text}");
}

/// Returns whether `openssl` is installed. Otherwise prints why the test is skipped.
fn has_openssl() -> bool {
    let found = Command::new("openssl").arg("version").output().is_ok();
    if !found {
        say_skipped("openssl is not installed, so no certificate of a server is tested");
    }
    found
}

#[test]
fn a_server_with_a_wrong_certificate_is_refused_in_one_sentence() {
    if !has_openssl() {
        return;
    }
    let port = own_port();
    let options = "-c listen_addresses=127.0.0.1 -c ssl=on -c ssl_cert_file=../server.crt -c ssl_key_file=../server.key";
    let Some(server) = Server::start_with(port, options, write_certificates) else {
        return;
    };
    let dir = empty();
    project(dir.path(), "lab", "1");
    let authority = server.folder().join("ca.crt");
    fs::set_permissions(&authority, fs::Permissions::from_mode(0o644)).expect("readable");
    let url = |more: &str| format!("postgres://mocban@localhost:{port}/postgres?sslmode={more}");
    let trusting = url(&format!("verify-full&sslrootcert={}", authority.display()));
    let mocban = |args: &[&str]| {
        let mut command = binary();
        command.current_dir(dir.path()).envs([PATIENT_CONNECT]);
        call(command.args(args))
    };
    let init = |url: &str| mocban(&["--catalog", url, "db", "init"]);
    init(&trusting).expect(0);

    let refused = |url: &str, text: &str| {
        for command in [
            &["db", "init"][..],
            &["-C", "lab", "status"],
            &["-C", "lab", "run"],
        ] {
            let begun = Instant::now();
            let refused = mocban(&[&["--catalog", url], command].concat()).expect(1);
            assert!(begun.elapsed() < AT_ONCE, "{command:?}");
            let address = format!("cannot connect to postgres://mocban@localhost:{port}/postgres");
            assert!(refused.err.contains(&address), "{}", refused.err);
            assert!(refused.err.contains(text), "{text}: {}", refused.err);
            assert_eq!(refused.err.lines().count(), 1, "{}", refused.err);
        }
    };
    refused(&url("verify-full"), "sslrootcert=FILE");
    for (certificate, text) in [
        ("expired", "the certificate of the server has expired"),
        ("other", "is for another host name"),
        ("self", "sslrootcert=FILE"),
    ] {
        server.stop_at_once();
        let certificate = server.folder().join(format!("{certificate}.crt"));
        let bytes = fs::read(certificate).expect("a certificate");
        fs::write(server.folder().join("server.crt"), bytes).expect("written");
        server.start_again();
        refused(&trusting, text);
        init(&url("require")).expect(0);
    }
    // Over its socket, the server has no TLS.
    let folder = server.folder().display();
    refused(&url(&format!("require&host={folder}")), "set `ssl = on`");
}
