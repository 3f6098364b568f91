//! Devices with faults, all at once, as these tests wait for most of their time.

use crate::{gps, hokuyo, imu, rplidar};

#[test]
fn damage_noise_silence_and_lag_are_named_and_survived() {
    let scenarios = [
        hokuyo::hokuyo_survives_damage_babble_noise_and_silence,
        hokuyo::hokuyo_that_lags_or_fails_is_named,
        rplidar::rplidar_survives_damage_and_says_what_is_wrong,
        gps::gps_survives_damage_and_noise,
        imu::imu_survives_damage_noise_and_a_lost_setting,
    ];
    std::thread::scope(|scope| {
        for scenario in scenarios {
            scope.spawn(scenario);
        }
    });
}
