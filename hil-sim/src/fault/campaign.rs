//! Every kind at random instants.
