#include "engine/scenario/breathing.h"

#include <cmath>
#include <gtest/gtest.h>
#include <vector>

namespace scenario {
namespace {

constexpr double frame = 1.0 / 15;

using Event = Breathing::Event;

VesselMotion quiet_breath() {
    VesselMotion motion;
    motion.breathing_reach = {0, 0, -12};
    motion.breath_hold = 6;
    return motion;
}

/// Frames until an event comes, or so many.
struct Patient {
    VesselMotion motion = quiet_breath();
    Breathing breathing;
    int frames = 0;

    double time() const { return frames * frame; }
    double depth() const { return inspiration(breathing.clock(time()), motion.breathing_rate); }
    Event next() {
        ++frames;
        return breathing.step(time(), frame, motion);
    }
    Event until_event(int most) {
        for (int k = 0; k < most; ++k)
            if (const Event event = next(); event != Event::None) return event;
        return Event::None;
    }
};

}  // namespace

TEST(Breathing, IsFreeUntilItIsAskedFor) {
    Patient patient;
    EXPECT_EQ(patient.until_event(1000), Event::None);
    EXPECT_EQ(patient.breathing.clock(patient.time()), patient.time());
}

TEST(Breathing, IsHeldAfterBreathingOutAndGoesOnFromThere) {
    for (int start = 0; start < 60; start += 4) {
        Patient patient;
        for (int k = 0; k < start; ++k) patient.next();
        patient.breathing.ask(true);
        double before = patient.depth();
        ASSERT_EQ(patient.until_event(60), Event::Held) << start;
        const double held = patient.depth();
        EXPECT_LE(held, Breathing::empty);
        for (int k = 0; k < 30; ++k) {
            EXPECT_EQ(patient.next(), Event::None);
            ASSERT_EQ(patient.depth(), held);
        }
        EXPECT_NEAR(patient.breathing.held_for(), 2, 1e-9);
        patient.breathing.ask(false);
        before = held;
        EXPECT_EQ(patient.next(), Event::Freed);
        // No jump, then or later; the deepest breath is as deep as before.
        double deepest = 0;
        for (int k = 0; k < 70; ++k) {
            EXPECT_LT(std::abs(patient.depth() - before), 0.1) << start << ", " << k;
            deepest = std::max(deepest, before = patient.depth());
            patient.next();
        }
        EXPECT_GT(deepest, 0.97);
    }
}

TEST(Breathing, EndsInAGaspWhenItWasHeldTooLong) {
    Patient patient;
    patient.breathing.ask(true);
    ASSERT_EQ(patient.next(), Event::Held);
    const int held = patient.frames;
    ASSERT_EQ(patient.until_event(200), Event::Gasped);
    EXPECT_NEAR((patient.frames - held) * frame, patient.motion.breath_hold, 1.01 * frame);
    patient.breathing.ask(true);
    EXPECT_EQ(patient.next(), Event::Refused);
    // Twice as many breaths, and then as before.
    const auto breaths = [&](double seconds) {
        const double from = patient.breathing.clock(patient.time());
        for (int k = 0; k < seconds / frame; ++k) patient.next();
        return (patient.breathing.clock(patient.time()) - from) / 4;
    };
    EXPECT_NEAR(breaths(6), 3, 0.05);
    breaths(4);
    EXPECT_NEAR(breaths(8), 2, 0.05);
    EXPECT_EQ(patient.breathing.state(), Breathing::State::Free);
    patient.breathing.ask(true);
    EXPECT_EQ(patient.until_event(60), Event::Held);
}

TEST(Breathing, AskedForAndCalledOffChangesNothing) {
    Patient patient;
    for (int k = 0; k < 20; ++k) patient.next();
    patient.breathing.ask(true);
    EXPECT_EQ(patient.next(), Event::None);
    patient.breathing.ask(false);
    EXPECT_EQ(patient.until_event(100), Event::None);
    EXPECT_EQ(patient.breathing.clock(patient.time()), patient.time());
}

TEST(Breathing, AStateGoesOnTheSame) {
    Patient patient;
    patient.breathing.ask(true);
    for (int k = 0; k < 150; k += 7) {
        Patient straight = patient, restored = patient;
        restored.breathing = {};
        geometry::restore_state(restored.breathing, geometry::state_of(patient.breathing));
        for (int n = 0; n < 200; ++n) {
            ASSERT_EQ(straight.next(), restored.next());
            ASSERT_EQ(straight.depth(), restored.depth());
        }
        for (int n = 0; n < 7; ++n) patient.next();
    }
}

}  // namespace scenario
