//! The run: workers, policy, execution of one pair, events.
