//! `host-bridge monitor`: lines that are right, states that are named, and a terminal that is left as it
//! was found.

use std::fs;
use std::io::{Read, Write};
use std::os::fd::{AsFd, AsRawFd};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use protocol::{DisplayState, Hello, Hold, Role};
use serialport::{SerialPort, TTYPort};
use tests::bridge::{self, Running};
use tests::fake_bench::FakeBench;
use tests::fake_board::{FakeBoard, wait_until};

/// Far more than anything here takes.
const LIMIT: Duration = Duration::from_secs(30);
