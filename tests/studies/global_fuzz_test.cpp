/// Thousands of random frames through the global relaxer, as a simulation plays them: pushes, pulls, turns of
/// the hub, bursts, loads, short budgets.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "engine/studies/plain_wire.h"
#include "physics/relax/relaxer.h"
#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

constexpr double passing_gradient = 1e-3;         // |g|/C at which the next segment may come in
constexpr int unlimited = 400 * 300;              // updates
constexpr double largest_turn = 10 * M_PI / 180;  // of the hub before the wire settles [rad]

struct Tally {
    std::vector<double> times;  // of the processor for a frame [ms]
    int frames = 0, unconverged = 0, kinks = 0, short_frames = 0, loaded = 0;
    double deepest = 0;  // penetration [mm]
};

class Player {
public:
    /// Random vessel and wire. `hardness` multiplies the wall's stiffness.
    Player(unsigned seed, double hardness, Tally& tally) : seed_(seed), random_(seed), tally_(tally) {
        std::vector<anatomy::PenMove> path = {anatomy::Run{20}};
        for (int k = 0; k < 8; ++k) {
            const Vec3 axis(2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1);
            path.push_back(anatomy::Arc{10 + 20 * unit(), (unit() < 0.5 ? -1 : 1) * (0.4 + unit()), axis});
            path.push_back(anatomy::Run{2 + 10 * unit()});
        }
        const Polyline line = anatomy::draw(path);
        length_ = anatomy::length(path);
        studies::PlainWire spec;
        spec.segment_length = unit() < 0.5 ? 1.0 : 1.5;
        spec.tip_length = 10 + 30 * unit();
        spec.transition_length = 20 + 80 * unit();
        spec.curved_length = 8 + 8 * unit();
        spec.curved_angle = 1.4 * unit();
        wall_.emplace(line, 1.2 + 2.5 * unit(), hardness * (10 + 40 * unit()), 0.44);
        relaxer_ = global_relaxer(*wall_);
        passing_ = make_relaxer(passing(), *wall_);
        wire_ = wire_along(spec, line, 30);
        relaxer_->relax(wire_, {unlimited, 0, 0});
    }

    void play(int frames) {
        for (int frame = 0; frame < frames; ++frame) {
            command();
            const bool cut_short = unit() < 0.1;
            const std::clock_t start = std::clock();
            step(cut_short ? 3 * wire_.segments() : unlimited);
            tally_.times.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
            judge(frame, cut_short);
            if (testing::Test::HasFatalFailure()) return;
        }
    }

private:
    double unit() { return random_() / 4294967296.0; }

    /// What the hand does in a frame, and the load for it.
    void command() {
        const double what = unit(), lambda = wire_.grid.segment_length;
        if (what < 0.40) {
            insertion_ += lambda;
        } else if (what < 0.55) {
            insertion_ -= lambda;
        } else if (what < 0.75) {
            rotation_ += (unit() - 0.5) * M_PI / 3;
        } else if (what < 0.9) {
            insertion_ += (2 + static_cast<int>(12 * unit())) * lambda;
        } else {
            insertion_ -= 10 * lambda;
        }
        insertion_ = std::min(insertion_, length_ - 15 - wire_.inserted_length());
        if (unit() < 0.15) change_load();
    }

    /// Off, or from a little more than a steel wire's weight to what lays a floppy tip flat on the wall.
    void change_load() {
        wire_.load.setZero();
        if (unit() < 0.3) return;
        Vec3 way(2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1);
        while (way.norm() > 1 || way.norm() < 0.1) way = Vec3(2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1);
        wire_.load = 1e-4 * std::pow(100.0, unit()) * way.normalized();
    }

    /// A frame of Simulation::step: what the budget does not allow waits for the next one.
    void step(int budget) {
        left_ = budget;
        if (!settled_) settle();
        while (settled_ && std::abs(insertion_) > 0.5 * wire_.grid.segment_length) {
            const double part = std::copysign(wire_.grid.segment_length, insertion_);
            insertion_ -= part;
            if (physics::move(wire_, part) == 0) insertion_ = 0;
            settle();
        }
        while (settled_ && rotation_ != 0) {
            const double part = std::clamp(rotation_, -largest_turn, largest_turn);
            rotation_ -= part;
            rotate(wire_, every_device, part);
            settle();
        }
        if (settled_) relax(*relaxer_);
    }

    /// A Newton method that stops within its budget can do no more; one that does not has to go on first.
    void settle() {
        const int budget = std::max(left_, wire_.segments());
        relax(*passing_);
        settled_ = last_.converged() || last_.updates + wire_.segments() <= budget;
    }

    void relax(Relaxer& relaxer) {
        last_ = relaxer.relax(wire_, {std::max(left_, wire_.segments()), 0, 0});
        left_ -= last_.updates;
    }

    /// A frame cut short may end anywhere on its way, as long as there is a way.
    void judge(int frame, bool cut_short) {
        Chain wire = wire_;
        RelaxReport report = last_;
        if (cut_short && !report.converged()) report = global_relaxer(*wall_)->relax(wire, {unlimited, 0, 0});
        ++tally_.frames;
        tally_.short_frames += cut_short;
        tally_.loaded += !wire.load.isZero(0);
        tally_.unconverged += !report.converged();
        if (!report.converged())
            testing::Test::RecordProperty(
                fmt::format("seed_{}_frame_{}", seed_, frame),
                fmt::format("|g|/C {:.1e}, strict {}, {} steps, N {}, bend {:.2f}, load {:.1e}",
                            report.gradient, report.strict_minimum(), report.newton_steps, wire.segments(),
                            report.largest_bend, wire.load.norm()));
        tally_.kinks += std::max(last_.largest_bend, report.largest_bend) > M_PI / 3;
        const auto broken = validate(wire_);
        ASSERT_TRUE(broken.empty()) << broken.front();
        tally_.deepest = std::max(tally_.deepest, largest_penetration(all_contacts(wire, *wall_)));
    }

    static RelaxerConfig passing() {
        RelaxerConfig config;
        config.tolerance = passing_gradient;
        return config;
    }

    unsigned seed_;
    std::mt19937 random_;
    Tally& tally_;
    double length_ = 0;  // of the vessel [mm]
    std::optional<TubeWall> wall_;
    Chain wire_;
    std::unique_ptr<Relaxer> relaxer_, passing_;
    double insertion_ = 0, rotation_ = 0;  // asked for and not made yet [mm], [rad]
    bool settled_ = true;
    int left_ = 0;      // updates of this frame
    RelaxReport last_;  // relaxation of this frame
};

/// Random frames in 50 vessels; SELDINGER_FUZZ_SEEDS=N plays N vessels.
Tally play_all(double hardness) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    const int vessels = more ? std::atoi(more) : 50;
    Tally tally;
    for (int seed = 1; seed <= vessels; ++seed)
        Player(static_cast<unsigned>(seed), hardness, tally).play(100);
    std::sort(tally.times.begin(), tally.times.end());
    testing::Test::RecordProperty(
        "tally", fmt::format("{} frames, {} loaded, {} cut short: {} unconverged, {} kinks, deepest contact "
                             "{:.1e} mm, p99 {:.2f} ms, longest {:.2f} ms",
                             tally.frames, tally.loaded, tally.short_frames, tally.unconverged, tally.kinks,
                             tally.deepest, tally.times[tally.times.size() * 99 / 100], tally.times.back()));
    return tally;
}

}  // namespace

TEST(GlobalFuzz, RandomFramesEndAtEquilibrium) {
    const Tally tally = play_all(1);
    EXPECT_LE(tally.unconverged, tally.frames / 1000);
    EXPECT_EQ(tally.kinks, 0);
    EXPECT_LT(tally.deepest, 0.5);
}

TEST(GlobalFuzz, RandomFramesInAWallAThousandTimesStifferEndAtEquilibrium) {
    const Tally tally = play_all(1000);
    EXPECT_LE(tally.unconverged, tally.frames / 200);
    EXPECT_EQ(tally.kinks, 0);
    EXPECT_LT(tally.deepest, 0.5 / 100);
}
