//! What the boards and hosts of Ridgelink say to each other.
//!
//! Plain data ([`Message`]), one frame format and a decoder that nothing can put out of step.
//! No DSP, no hardware, no allocation: the same code runs on both boards and on every host.
#![no_std]

pub mod actuators;
pub mod capabilities;
mod checksum;
pub mod clock;
pub mod configuration;
pub mod console;
pub mod frame;
pub mod hello;
pub mod latest;
pub mod line;
pub mod message;
pub mod port;
pub mod receiver;
mod refusal;
pub mod safety;
pub mod sender;
mod sequence;
pub mod status;
pub mod stop;
pub mod texture;

pub use actuators::{
    ACTUATOR_BLOCK, ACTUATORS, Actuator, Actuators, DEFAULT_ACTUATORS, UNITY_GAIN,
};
pub use capabilities::{
    Capabilities, DisplayCapabilities, Question, SensorCapabilities, SettingRange,
};
pub use clock::ClockOffset;
pub use configuration::{
    Configuration, ConfigurationReport, Configure, DisplayConfiguration, Method, Mode, Rendering,
    SensorConfiguration, UpdateRate,
};
pub use console::{Console, Key, Line};
pub use frame::MAX_FRAME;
pub use hello::{HELLO_LENGTH, Hello, Role};
pub use latest::Latest;
pub use message::{
    CHANNELS, Contact, Estimate, GAUGE_BLOCK, GAUGES, GaugeHealth, GaugeSample, Gauges, Message,
    Motion, PROTOCOL_VERSION, Ping, Pong, Range, SCHEMA_HASH, StreamGauges,
};
pub use port::Port;
pub use receiver::{Event, Peer, Receiver};
pub use refusal::{Refusal, Setting};
pub use safety::{Arm, ArmState, DisplayState, Hold, Safety, Trip};
pub use sender::Sender;
pub use status::{DisplayCounters, PortCounters, ResetCause, RoleCounters, SensorCounters, Status};
pub use stop::{STOP_LENGTH, Stop, StopReason, Stopped};
pub use texture::{Friction, Partial, Texture};
