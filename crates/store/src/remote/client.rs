//! The client of S3-compatible stores: its time limits and repetitions, and its keys.

use std::sync::{Arc, LazyLock, OnceLock};
use std::time::Duration;

use object_store::aws::AmazonS3Builder;
use object_store::{BackoffConfig, ClientOptions, ObjectStore, RetryConfig};

use mocban_system::failpoint;

/// Longest time to open a connection.
const CONNECT: Duration = Duration::from_secs(10);
/// Longest time without a byte of a reply.
const SILENCE: Duration = Duration::from_secs(30);
/// A request is given up if it had no success for this long.
const GIVE_UP: Duration = Duration::from_mins(4);
/// A first request that only shows whether the store answers is given up after this time.
const GIVE_UP_FIRST: Duration = Duration::from_secs(5);

/// Returns the divisor of time limits in tests.
pub(super) fn time_scale() -> u32 {
    static SCALE: LazyLock<u32> =
        LazyLock::new(|| failpoint::time_scale("MOCBAN_STORE_TIME_SCALE"));
    *SCALE
}

/// A client of a bucket that is made at its first use, because commands such as `status` send no requests and need no keys.
#[derive(Debug)]
pub(super) struct LazyClient {
    bucket: String,
    made: OnceLock<Result<Arc<dyn ObjectStore>, String>>,
}

impl LazyClient {
    /// Returns the client of a bucket.
    pub(super) fn new(bucket: &str) -> Self {
        Self {
            bucket: bucket.to_owned(),
            made: OnceLock::new(),
        }
    }

    /// Returns a client that is made already.
    #[cfg(test)]
    pub(super) fn of(store: Arc<dyn ObjectStore>) -> Self {
        Self {
            bucket: String::new(),
            made: OnceLock::from(Ok(store)),
        }
    }

    /// Returns the client.
    ///
    /// # Errors
    /// Returns the reason if a variable of the environment is missing or has a wrong value.
    pub(super) fn get(&self) -> Result<Arc<dyn ObjectStore>, &str> {
        let give_up = GIVE_UP / time_scale();
        let made = self.made.get_or_init(|| connect(&self.bucket, give_up));
        made.as_ref().map(Arc::clone).map_err(String::as_str)
    }

    /// Returns another client of the same bucket, whose requests are given up soon.
    ///
    /// # Errors
    /// Returns the reason if a variable of the environment is missing or has a wrong value.
    pub(super) fn for_first_request(&self) -> Result<Arc<dyn ObjectStore>, String> {
        connect(&self.bucket, GIVE_UP_FIRST)
    }
}

/// Returns a client of a bucket. Sends no request. Credentials, region and endpoint are those of the environment.
///
/// # Errors
/// Returns the reason if a variable is missing or has a wrong value.
fn connect(bucket: &str, give_up: Duration) -> Result<Arc<dyn ObjectStore>, String> {
    require_keys()?;
    // The client would look for a provider of cryptography and find none. Another call may have installed it.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let endpoint = std::env::var("AWS_ENDPOINT_URL").unwrap_or_default();
    let allows_http = std::env::var("AWS_ALLOW_HTTP").is_ok_and(|value| value == "true");
    let client = ClientOptions::new()
        .with_timeout_disabled()
        .with_connect_timeout(CONNECT)
        .with_read_timeout(SILENCE)
        .with_allow_http(allows_http || is_loopback(&endpoint));
    let retry = RetryConfig {
        backoff: BackoffConfig {
            init_backoff: Duration::from_millis(100),
            max_backoff: Duration::from_secs(10),
            base: 2.0,
        },
        max_retries: usize::MAX,
        retry_timeout: give_up,
    };
    let builder = AmazonS3Builder::from_env().with_client_options(client);
    let store = builder.with_bucket_name(bucket).with_retry(retry).build();
    match store {
        Ok(store) => Ok(Arc::new(store)),
        Err(_) => Err("the AWS_ variables of the environment have wrong values".to_owned()),
    }
}

/// Refuses an endpoint without keys. Without an endpoint, the client also asks the machine for keys, as in AWS.
fn require_keys() -> Result<(), String> {
    let has = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let sources = [
        "AWS_ACCESS_KEY_ID",
        "AWS_WEB_IDENTITY_TOKEN_FILE",
        "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
        "AWS_CONTAINER_CREDENTIALS_FULL_URI",
        "AWS_SKIP_SIGNATURE",
    ];
    if has("AWS_ENDPOINT_URL") && !sources.into_iter().any(has) {
        return Err(
            "no keys: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY (or AWS_SKIP_SIGNATURE=true for a public store)"
                .to_owned(),
        );
    }
    Ok(())
}

/// Returns whether a URL names this machine, so that no network sees the requests.
fn is_loopback(url: &str) -> bool {
    let host = url.strip_prefix("http://").unwrap_or_default();
    ["127.0.0.1", "localhost", "[::1]"].iter().any(|name| {
        host.strip_prefix(name)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with([':', '/']))
    })
}

#[cfg(test)]
mod tests {
    use super::is_loopback;

    #[test]
    fn only_addresses_of_this_machine_need_no_encryption() {
        assert!(is_loopback("http://127.0.0.1:8333") && is_loopback("http://localhost/"));
        assert!(!is_loopback("http://127.0.0.1.example.org") && !is_loopback("https://x"));
    }
}
