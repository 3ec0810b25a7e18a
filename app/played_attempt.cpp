#include "app/played_attempt.h"

#include <fmt/format.h>

#include "app/command.h"
#include "engine/exercise/exercise.h"
#include "engine/room/played_hand.h"

namespace app {

const char* const by_a_program =
    "a program: each exercise's solution at the speed of the room's keys, amounts off by up to 5 %, 1.35 s "
    "to "
    "decide between movements; no physician took part";

room::Speeds key_speeds() {
    return room::load_keys(assets() / "keys.toml").speeds;
}

std::optional<exercise::Score> played_attempt(const scenario::Scenario& scenario,
                                              const script::CommandScript& solution,
                                              const room::Speeds& speeds, std::uint64_t seed,
                                              const anatomy::ModelCache& cache,
                                              const std::filesystem::path& keep) {
    exercise::Exercise exercise(scenario, exercise::Pictures::Dose, cache);
    if (!keep.empty()) {
        script::RecordingHeader header{origin(fmt::format("played {}", seed))};
        exercise.record(keep, header);
    }
    room::PlayedHand hand(solution, speeds, scenario.frame_rate, {}, seed);
    exercise::StepReport last;
    // It holds still at the end for as long as the target asks, and a little more.
    const int still = static_cast<int>((scenario.target.hold + 1) * scenario.frame_rate);
    for (int after = 0; after < still && !exercise.completed() && !exercise.time_is_up();
         after += hand.done()) {
        if (stop_requested()) return std::nullopt;
        last = exercise.next_frame(hand.next(last)).motion;
    }
    exercise.close_recording();
    return exercise.finish();
}

}  // namespace app
