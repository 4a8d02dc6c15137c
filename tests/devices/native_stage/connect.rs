//! What may be behind a port: a board that boots, a bad line, another firmware, something else.

use super::*;

#[test]
fn a_board_that_boots_is_waited_for_no_longer_than_it_takes() {
    steady(|| {
        let boot = Duration::from_millis(700);
        let emulator = power(NativeStageSetup { boot, ..Default::default() });
        let began = HostTime::now();
        NativeStage::connect(&options(&emulator)).expect("it answers once it has booted");
        let took = HostTime::now().since(began);
        println!("connected after {took:?}");
        assert!(took >= boot - Duration::from_millis(20) && took < boot + Duration::from_secs(2));
    });
}

#[test]
fn it_connects_over_a_bad_line() {
    steady(|| {
        let emulator = power(NativeStageSetup { seed: 6, ..Default::default() });
        emulator.faults().change(|faults| faults.corrupt_share = 0.01);
        let began = HostTime::now();
        NativeStage::connect(&options(&emulator)).expect("a bad line delays");
        println!("connected after {:?}", HostTime::now().since(began));
    });
}

#[test]
fn another_table_is_refused_identified_and_stopped() {
    steady(|| {
        let emulator = power(NativeStageSetup { other_schema: Some(0xBAD), ..Default::default() });
        let options = options(&emulator);
        let error = NativeStage::connect(&options).err().expect("another table");
        assert!(
            matches!(error, DriverError::NativeSchema { schema: 0xBAD, ours: SCHEMA_HASH, .. }),
            "{error}"
        );
        assert!(
            error.to_string().contains("emulated stage") && error.to_string().contains("0000000000000bad"),
            "{error}"
        );
        use phantom_rig::device::Stopper;
        NativeStopper::open(&options).expect("the port opens").stop_now().expect("it takes the bytes");
        let until = HostTime::now() + DEADLINE;
        while emulator.truth().patterns == 0 {
            assert!(!until.remaining().is_zero(), "it never hears the pattern");
            std::thread::sleep(Duration::from_millis(1));
        }
    });
}

/// Somebody else at the port's other end, who says the same again and again, or what was said.
fn talker(say: Option<&'static [u8]>) -> (String, impl Drop) {
    struct Talker(Option<std::thread::JoinHandle<()>>, Arc<AtomicU64>);
    impl Drop for Talker {
        fn drop(&mut self) {
            self.1.store(1, Ordering::Release);
            self.0.take().expect("dropped once").join().expect("no panics");
        }
    }
    use serialport::SerialPort;
    let (mut end, other) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let path = other.name().expect("it has a name");
    let ended = Arc::new(AtomicU64::new(0));
    let over = Arc::clone(&ended);
    let thread = std::thread::spawn(move || {
        let _held = other;
        end.set_timeout(Duration::from_millis(5)).expect("it takes a time-out");
        let mut heard = [0; 256];
        while over.load(Ordering::Acquire) == 0 {
            let count = end.read(&mut heard).unwrap_or(0);
            let _ = end.write_all(say.unwrap_or(&heard[..count]));
        }
    });
    (path, Talker(Some(thread), ended))
}

#[test]
fn something_else_on_the_port_is_named_for_what_it_says() {
    steady(|| {
        let patient =
            |path: &str| NativeOptions { greeting: Duration::from_millis(500), ..NativeOptions::new(path) };
        let (path, _talker) = talker(Some(b"Grbl 1.1h ['$' for help]\r\n"));
        let error = NativeStage::connect(&patient(&path)).err().expect("a Grbl");
        assert!(error.to_string().contains("Grbl 1.1h") && error.to_string().contains(&path), "{error}");
        let (path, _echo) = talker(None);
        let error = NativeStage::connect(&patient(&path)).err().expect("an echo");
        assert!(matches!(error, DriverError::Device(DeviceError::Nonsense { .. })), "{error}");
        let (path, _silent) = talker(Some(b""));
        let error = NativeStage::connect(&patient(&path)).err().expect("nobody");
        assert!(matches!(error, DriverError::Device(DeviceError::Silent { .. })), "{error}");
        let error = NativeStage::connect(&patient("/dev/there-is-no-such-port")).err().expect("no port");
        assert!(matches!(error, DriverError::Open { .. }), "{error}");
    });
}
