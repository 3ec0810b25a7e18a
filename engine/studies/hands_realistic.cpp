#include "engine/studies/hands_realistic.h"

#include <algorithm>

#include "engine/scenario/scenario.h"
#include "physics/geometry/parallel.h"

namespace studies {

SlowHand::Motion SlowHand::next(double dt, std::span<const scenario::PlacedDevice> devices) {
    if (now_ >= until_) {
        until_ = now_ + 0.5 + 1.5 * unit();
        const double what = unit(), speed = fastest_feed * unit();
        wanted_feed_ = what < 0.6 ? speed : what < 0.8 ? -speed : 0;
        wanted_turn_ = unit() < 0.4 ? fastest_turn * (2 * unit() - 1) * unit() : 0;
        if (devices.size() > 1) {
            const std::size_t k = random_() % (devices.size() + 1);
            held_ = k < devices.size() ? devices[k].role : script::DeviceRole::All;
        }
    }
    now_ += dt;
    const double follow = std::min(1.0, 3 * dt);
    feed_ += follow * (wanted_feed_ - feed_);
    turn_ += follow * (wanted_turn_ - turn_);
    const auto of = [dt](double speed, double least) {
        return std::abs(speed * dt) > least ? speed * dt : 0.0;
    };
    return {held_, of(feed_, 1e-3), of(turn_, 1e-4)};
}

script::DeviceRole SlowHand::act(exercise::Simulation& simulation) {
    const Motion motion = next(1 / simulation.scenario().frame_rate, simulation.devices());
    if (motion.feed > 0) simulation.apply(script::Advance{motion.feed, motion.held});
    if (motion.feed < 0) simulation.apply(script::Withdraw{-motion.feed, motion.held});
    if (motion.turn != 0) simulation.apply(script::Rotate{motion.turn, motion.held});
    return motion.held;
}

namespace {

void play_slowly(exercise::Simulation& simulation, std::uint32_t seed, int frames, FeltPushes& felt) {
    simulation.reset();
    SlowHand hand(seed);
    for (int frame = 0; frame < frames; ++frame) {
        const script::DeviceRole held = hand.act(simulation);
        const exercise::StepReport report = simulation.step();
        ++felt.frames;
        felt.buckled += report.buckled;
        felt.refused += report.refused && !report.buckled;
        felt.settling += report.settling;
        felt.not_at_rest += !simulation.readings().at_rest;
        double push = -1e9;
        for (const scenario::PlacedDevice& device : simulation.devices()) {
            if (held != script::DeviceRole::All && device.role != held) continue;
            const double load = simulation.hand(device.role).load.push;
            push = std::max(push, load);
            felt.largest_pull = std::max(felt.largest_pull, -load);
        }
        if (!hand.pushes() || report.insertions.empty()) continue;
        ++felt.pushing;
        felt.pushes.push_back(push);
    }
}

std::vector<std::filesystem::path> exercises(const StudyOptions& options) {
    std::vector<std::filesystem::path> files;
    if (std::filesystem::is_directory(options.scenarios))
        files = scenario::shipped_scenarios(options.scenarios);
    if (options.quick)
        std::erase_if(files, [](const auto& f) { return f.stem() != "s_bend" && f.stem() != "cerebral"; });
    return files;
}

}  // namespace

std::vector<ExerciseBalance> balance_exercises(const StudyOptions& options, int frames,
                                               const std::function<void(const std::string&)>& done) {
    const auto files = exercises(options);
    std::vector<ExerciseBalance> all(files.size());
    geometry::for_each_index(static_cast<int>(files.size()), options.threads, [&](int k) {
        ExerciseBalance& of = all[static_cast<std::size_t>(k)];
        of.scenario = files[static_cast<std::size_t>(k)].stem().string();
        HandCourse course(options, {of.scenario});
        course.feed_step = 0.25, course.turn_step = 2 * geometry::degree;
        SlowHand hand(1);
        const double dt = 1 / course.simulation().scenario().frame_rate;
        for (int frame = 0; frame < frames; ++frame) {
            const SlowHand::Motion motion = hand.next(dt, course.simulation().devices());
            if (motion.feed != 0) course.feed(motion.feed, motion.held);
            if (motion.turn != 0) course.turn(motion.turn, motion.held);
        }
        of.balance = course.balance();
        done(of.scenario);
    });
    return all;
}

std::vector<FeltPushes> feel_pushes(const StudyOptions& options, int frames,
                                    const std::function<void(const std::string&, int)>& done) {
    const auto files = exercises(options);
    const int count = static_cast<int>(files.size()), hands = options.quick ? 1 : realistic_hands;
    std::vector<FeltPushes> all(files.size());
    geometry::for_each_index(count, options.threads, [&](int k) {
        const auto fraction = [&](int piece) {
            return static_cast<int>(1LL * frames * piece / (count * hands));
        };
        exercise::Simulation simulation(
            scenario::load_scenario(files[static_cast<std::size_t>(k)], options.devices), options.cache);
        FeltPushes& felt = all[static_cast<std::size_t>(k)];
        felt.scenario = simulation.scenario().name;
        for (int hand = 1; hand <= hands; ++hand) {
            const int piece = k * hands + hand, some = fraction(piece) - fraction(piece - 1);
            play_slowly(simulation, static_cast<std::uint32_t>(hand), some, felt);
            done(felt.scenario, some);
        }
    });
    return all;
}

}  // namespace studies
