#include <gtest/gtest.h>

#include "engine/exercise/score.h"
#include "tests/engine/vessels.h"

namespace exercise {
namespace {

/// An aorta down to z = 0, two legs from there, two renal arteries, the left with a child.
anatomy::Anatomy tree() {
    anatomy::Anatomy tree;
    test::add_branch(tree, "aorta", -1, {0, 0, 100}, {0, 0, 0}, 9);
    test::add_branch(tree, "left", 0, {0, 0, 0}, {60, 0, -60}, 4);
    test::add_branch(tree, "right", 0, {0, 0, 0}, {-60, 0, -60}, 4);
    test::add_branch(tree, "LRA", 0, {0, 0, 60}, {50, 0, 60}, 3);
    test::add_branch(tree, "RRA", 0, {0, 0, 55}, {-50, 0, 55}, 3);
    test::add_branch(tree, "LRA+pole", 3, {30, 0, 60}, {50, 0, 90}, 2);
    return tree;
}

struct Walk {
    anatomy::Anatomy anatomy = tree();
    WrongTurns turns{anatomy, {50, 0, -50}, {40, 0, 60}};  // from the left leg to the left renal artery
    void to(double x, double z) { turns.observe(anatomy, {x, 0, z}, 0.5); }
    int entries() const {
        int sum = 0;
        for (const WrongBranch& branch : turns.branches()) sum += branch.entries;
        return sum;
    }
    double seconds() const {
        double sum = 0;
        for (const WrongBranch& branch : turns.branches()) sum += branch.seconds;
        return sum;
    }
};

}  // namespace

TEST(WrongTurns, TheWayToTheTargetIsNone) {
    Walk walk;
    for (double s = 50; s > 0; s -= 2) walk.to(s, -s);
    for (double z = 0; z < 60; z += 2) walk.to(0, z);
    for (double x = 0; x < 45; x += 2) walk.to(x, 60);
    walk.to(0, 95);  // beyond the ostium, but in the aorta
    EXPECT_EQ(walk.entries(), 0);
    EXPECT_EQ(walk.seconds(), 0);
}

TEST(WrongTurns, CountsEntriesAndTimeByName) {
    Walk walk;
    walk.to(-30, -30);  // crossed over into the other leg
    walk.to(-32, -32);
    walk.to(0, 10);
    walk.to(-30, 55);
    walk.to(0, 55);
    walk.to(-30, 55);
    ASSERT_EQ(walk.turns.branches().size(), 2u);
    EXPECT_EQ(walk.turns.branches()[0].name, "right");
    EXPECT_EQ(walk.turns.branches()[0].entries, 1);
    EXPECT_DOUBLE_EQ(walk.turns.branches()[0].seconds, 1.0);
    EXPECT_EQ(walk.turns.branches()[1].name, "RRA");
    EXPECT_EQ(walk.turns.branches()[1].entries, 2);
    EXPECT_DOUBLE_EQ(walk.turns.branches()[1].seconds, 1.0);
    EXPECT_EQ(walk.entries(), 3);
    EXPECT_DOUBLE_EQ(walk.seconds(), 2.0);
}

TEST(WrongTurns, AnOstiumIsNoEntryAndAnUncertainTipEntersOnce) {
    Walk walk;
    walk.to(-9.5, 55);  // in the mouth of the right renal artery, half a millimetre out of the aorta
    EXPECT_EQ(walk.entries(), 0);
    walk.to(-10.5, 55);
    EXPECT_EQ(walk.entries(), 1);
    walk.to(-9.5, 55);  // has not left until it is back inside the aorta
    walk.to(-10.5, 55);
    EXPECT_EQ(walk.entries(), 1);
    walk.to(-8.5, 55);
    walk.to(-10.5, 55);
    EXPECT_EQ(walk.entries(), 2);
}

TEST(WrongTurns, BeyondTheTargetABranchIsWrongAndTheWayBackIntoItsParentIsNoEntry) {
    Walk walk;
    walk.to(45, 82.5);
    walk.to(30, 60);
    EXPECT_EQ(walk.entries(), 1);
    EXPECT_EQ(walk.turns.branches()[0].name, "LRA+pole");

    WrongTurns other(walk.anatomy, {50, 0, -50},
                     {-40, 0, 55});  // to the right one: the left and its child are wrong
    other.observe(walk.anatomy, {25, 0, 60}, 1);
    other.observe(walk.anatomy, {45, 0, 82.5}, 1);
    other.observe(walk.anatomy, {25, 0, 60}, 1);
    ASSERT_EQ(other.branches().size(), 2u);
    EXPECT_EQ(other.branches()[0].entries, 1);
    EXPECT_DOUBLE_EQ(other.branches()[0].seconds, 2);
    EXPECT_EQ(other.branches()[1].entries, 1);
}

TEST(WrongTurns, StateIsRestored) {
    Walk walk;
    walk.to(-30, 55);
    const auto kept = geometry::state_of(walk.turns);
    walk.to(0, 55);
    walk.to(-30, 55);
    EXPECT_EQ(walk.entries(), 2);
    geometry::restore_state(walk.turns, kept);
    walk.to(-30, 55);
    EXPECT_EQ(walk.entries(), 1);
}

}  // namespace exercise
