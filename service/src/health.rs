//! Is a daemon ready? Asked from outside, through the network, as its clients would.

use pdn_transport::session::{self, Config, SessionError};
use std::time::Duration;

/// Whether a daemon declares that it is ready behind the router that the configuration connects to.
///
/// # Errors
/// There is no router.
pub async fn is_ready(config: Config, timeout: Duration) -> Result<bool, SessionError> {
    let session = session::open(config, timeout).await?;
    let ready = session::finds_ready(&session, timeout).await;
    session::close(&session, timeout).await;
    Ok(ready)
}

/// The first endpoint that a daemon listens on, as one connects to it from the same machine.
pub fn reachable(listens_on: &[String]) -> String {
    let first = listens_on.first().map_or("tcp/127.0.0.1:7447", String::as_str);
    first.replacen("/0.0.0.0:", "/127.0.0.1:", 1).replacen("/[::]:", "/[::1]:", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_address_is_reached_by_loopback() {
        assert_eq!(reachable(&["tcp/0.0.0.0:7447".to_owned()]), "tcp/127.0.0.1:7447");
        assert_eq!(reachable(&["tcp/[::]:1".to_owned()]), "tcp/[::1]:1");
        assert_eq!(reachable(&["tls/vehicle:7447".to_owned()]), "tls/vehicle:7447");
        assert_eq!(reachable(&[]), "tcp/127.0.0.1:7447");
    }
}
