//! What the sensor makes of scenes, on the native engine: every goal of the estimation, one concern a
//! module.

mod alignment;
mod contact;
mod goals;
mod health;
mod running;
mod stranger;
mod unseen;
