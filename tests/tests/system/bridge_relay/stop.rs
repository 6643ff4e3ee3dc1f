//! A Stop across the network.

use super::*;

#[test]
fn a_board_that_another_program_stopped_stops_the_other_site() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(10));
    display.say(Message::Stopped(Stopped::by(Trip::EmergencyStop)));
    listen(&sensor, LIMIT, |heard| {
        heard
            .iter()
            .any(|message| matches!(message, Message::Stop(_)))
    });
    pair.display
        .says("the board at the sensor's site has stopped", LIMIT);
    // And that is all: nobody says it back.
    pass(&pair.bench, Duration::from_secs(1));
    sensor.take_heard();
    display.take_heard();
    pass(&pair.bench, Duration::from_secs(1));
    for board in [&sensor, &display] {
        let heard = board.take_heard();
        assert!(
            !heard
                .iter()
                .any(|message| matches!(message, Message::Stop(_)))
        );
    }
}

#[test]
fn stop_reaches_both_boards_from_either_site_also_when_the_network_was_away() {
    const DELAY: Duration = Duration::from_millis(30);
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    pair.network.delay(DELAY, Duration::ZERO);
    listen(&sensor, LIMIT, at_least(10));

    pair.sensor.site.stop(STOP);
    // One way over the network, and until the board looks.
    let soon = DELAY + Duration::from_millis(2);
    listen(&display, soon, |heard| heard.iter().any(is_stop));
    listen(&sensor, LIMIT, |heard| heard.iter().any(is_stop));
    pair.sensor.says(
        "Stop: the board at the display's site has stopped: by the operator",
        LIMIT,
    );
    pair.display.says("Stop, said by the sensor's site", LIMIT);
    pair.display
        .says("Stop: the board here has stopped: by the operator", LIMIT);

    pair.display.site.stop(STOP);
    pair.display.says(
        "Stop: the board at the sensor's site has stopped: by the operator",
        LIMIT,
    );

    // Said while the network is away, it comes when it is back.
    pair.network.cut(true);
    pair.display.says("the sensor's site: silent", LIMIT);
    display.take_heard();
    pair.sensor.site.stop(STOP);
    pass(&pair.bench, Duration::from_secs(5));
    assert!(!display.take_heard().iter().any(is_stop));
    pair.network.cut(false);
    listen(&display, LIMIT, |heard| heard.iter().any(is_stop));
}

#[test]
fn an_operators_stop_is_done_only_when_the_display_itself_says_that_it_has_stopped() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(10));
    let clock: Arc<dyn Clock> = Arc::new(pair.bench.clock.clone());
    let stop = |name: Name, within| -> Stopping {
        operator::stop(&pair.network, &clock, &name, STOP, within)
            .unwrap_or_else(|error| panic!("{error}"))
    };
    const SHORT: Duration = Duration::from_secs(1);

    // Its bridge has written it, and yet the display goes on.
    display.disobey(true);
    assert_eq!(stop(name(), SHORT).progress, Progress::Told);
    let told = display.take_heard().into_iter().filter(is_stop).count();
    assert!(
        told > 1,
        "a line may garble what is said: told {told} times"
    );

    // It is told until it obeys.
    let result = Arc::new(Mutex::new(None));
    let (theirs, network, own) = (
        Arc::clone(&result),
        pair.network.clone(),
        Arc::clone(&clock),
    );
    let stopping = clock.spawn(Box::new(move || {
        let stopping = operator::stop(&network, &own, &name(), STOP, LIMIT);
        *locked(&theirs) = stopping.ok();
    }));
    listen(&display, LIMIT, |heard| heard.iter().any(is_stop));
    display.disobey(false);
    clock.join(stopping);
    let wanted = Stopping {
        progress: Progress::Stopped,
        trip: Some(Trip::Operator),
    };
    assert_eq!(*locked(&result), Some(wanted));

    let other = "other".parse().expect("a name");
    assert_eq!(stop(other, SHORT).progress, Progress::Unheard);
    drop(display);
    pair.display.says("not there", LIMIT);
    assert_eq!(stop(name(), SHORT).progress, Progress::Heard);
}

#[test]
fn an_operators_stop_reaches_a_site_that_the_network_had_cut_off() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(10));
    pair.network.cut_off(Role::Sensor, true);
    let clock: Arc<dyn Clock> = Arc::new(pair.bench.clock.clone());
    let stopping = operator::stop(&pair.network, &clock, &name(), STOP, LIMIT);
    assert_eq!(
        stopping.map(|stopping| stopping.progress).ok(),
        Some(Progress::Stopped)
    );
    assert!(display.take_heard().iter().any(is_stop));
    pass(&pair.bench, Duration::from_secs(5));
    assert!(!sensor.take_heard().iter().any(is_stop));
    // The operator has gone: the display's site says it on.
    pair.network.cut_off(Role::Sensor, false);
    listen(&sensor, LIMIT, |heard| heard.iter().any(is_stop));
    pair.display.says(
        "Stop: the board at the sensor's site has stopped: by the operator",
        LIMIT,
    );
}

#[test]
fn a_board_that_started_anew_unseen_is_known_to_go_again() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(10));
    let is_told = |heard: &[Message]| {
        heard
            .iter()
            .any(|message| matches!(message, Message::Stop(_)))
    };
    display.say(Message::Stopped(Stopped::by(Trip::EmergencyStop)));
    listen(&sensor, LIMIT, is_told);
    pair.display
        .says("the board at the sensor's site has stopped", LIMIT);
    sensor.take_heard();
    // Its clock would have told of a start that was seen.
    let state = DisplayState::Driving;
    display.say(Message::Safety(Safety {
        instant_us: 0,
        state,
    }));
    pass(&pair.bench, Duration::from_secs(1));
    display.say(Message::Stopped(Stopped::by(Trip::EmergencyStop)));
    listen(&sensor, LIMIT, is_told);
}

#[test]
fn a_board_that_does_not_answer_a_stop_is_named_once_at_both_sites() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(10));
    const NOT_STOPPED: &str = "NOT STOPPED as far as is known: ";
    let unstopped = |site: &VirtualSite| -> Vec<String> {
        let mut words = site.words();
        words.retain(|line| line.contains("NOT STOPPED"));
        words
    };
    // Who answers is not named.
    pair.sensor.site.stop(STOP);
    pair.sensor
        .says("the board at the display's site has stopped", LIMIT);
    pass(&pair.bench, Duration::from_secs(5));
    for site in [&pair.sensor, &pair.display] {
        assert_eq!(unstopped(site), [""; 0]);
    }
    display.disobey(true);
    pair.sensor.site.stop(STOP);
    let there = format!("{NOT_STOPPED}the board at the display's site has not answered");
    let here = format!("{NOT_STOPPED}the board here has not answered");
    pair.display.says(&here, Duration::from_secs(1));
    pair.sensor.says(&there, Duration::from_secs(3));
    pass(&pair.bench, Duration::from_secs(5));
    for site in [&pair.sensor, &pair.display] {
        assert_eq!(unstopped(site).len(), 1, "{:?}", site.words());
    }
    // Whoever says it again wants to know again.
    pair.sensor.site.stop(STOP);
    let again = || unstopped(&pair.sensor).len() == 2;
    assert!(wait_by(&display, LIMIT, again), "{:?}", pair.sensor.words());
    display.disobey(false);
    let stopped = || {
        let words = pair.sensor.words();
        words.iter().rposition(|line| line.contains("has stopped"))
            > words.iter().rposition(|line| line.contains("NOT STOPPED"))
    };
    assert!(wait_by(&display, LIMIT, stopped));
}
