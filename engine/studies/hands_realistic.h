#pragma once
/// Hands at the speeds of physicians in every exercise: what they feel.

#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "engine/studies/hands_course.h"
#include "engine/studies/study.h"

namespace studies {

/// Pushes, draws back and turns as a hand that looks for its way: no faster than 60 mm/s and 180°/s, its
/// speeds smooth over a third of a second. Every second or so it chooses anew what to do, twice as often on
/// as back; where there are several devices, which of them it holds. The seed determines all, on any machine.
class SlowHand {
public:
    static constexpr double fastest_feed = 60;                      // [mm/s]
    static constexpr double fastest_turn = 180 * geometry::degree;  // [rad/s]

    /// Of one frame.
    struct Motion {
        script::DeviceRole held = script::DeviceRole::Wire;
        double feed = 0, turn = 0;  // [mm], [rad]
    };

    explicit SlowHand(std::uint32_t seed) : random_(seed) {}
    /// What it does in the next frame of dt [s].
    Motion next(double dt, std::span<const scenario::PlacedDevice>);
    /// Performs the hand's next frame; returns the device that it holds.
    script::DeviceRole act(exercise::Simulation&);
    /// Whether the last frame fed inward.
    bool pushes() const { return feed_ > 0; }

private:
    double unit() { return static_cast<double>(random_()) / 4294967296.0; }
    std::mt19937 random_;
    double feed_ = 0, turn_ = 0, wanted_feed_ = 0, wanted_turn_ = 0;  // [mm/s], [rad/s]
    double now_ = 0, until_ = 0;                                      // [s]
    script::DeviceRole held_ = script::DeviceRole::Wire;
};

/// Of one exercise.
struct FeltPushes {
    std::string scenario;
    int frames = 0, pushing = 0;  // pushing: in which the hand fed inward
    std::vector<double> pushes;   // of the device that is fed, in those frames [N]
    double largest_pull = 0;      // of all frames [N]
    int buckled = 0, refused = 0, not_at_rest = 0, settling = 0;
};

constexpr int realistic_hands = 3;  // 1 in a quick study
/// Hands with the seeds 1 to 3 play each exercise that ships, `frames` in all, divided evenly. A quick study
/// has one hand and two exercises.
std::vector<FeltPushes> feel_pushes(const StudyOptions&, int frames,
                                    const std::function<void(const std::string&, int)>& done);

/// Balance of the hands' work in an exercise.
struct ExerciseBalance {
    std::string scenario;
    HandBalance balance;
};
/// The hand with seed 1 in each exercise, for so many frames, each cut into steps of at most 0.25 mm or 2°.
std::vector<ExerciseBalance> balance_exercises(const StudyOptions&, int frames,
                                               const std::function<void(const std::string&)>& done);

}  // namespace studies
