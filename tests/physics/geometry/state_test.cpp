#include "physics/geometry/state.h"

#include <gtest/gtest.h>

#include "physics/geometry/vec.h"

namespace geometry {
namespace {

enum class Kind { one, two };
struct Part {
    double weight = 0;
    std::vector<Vec3> places;
    void state(StateStream& s) { s(weight, places); }
};
struct Whole {
    int count = 0;
    bool flag = false;
    Kind kind = Kind::one;
    std::string name;
    std::optional<Part> part;
    std::deque<Part> parts;
    std::array<double, 2> pair{};
    Mat3 matrix = Mat3::Zero();
    int made_again = 0;
    void state(StateStream& s) {
        s(count, flag, kind, name, part, parts, pair, matrix);
        if (s.restores()) made_again = 1;
    }
};

Whole some() {
    Whole w{7, true, Kind::two, "a wire", Part{0.1, {Vec3(1, 2, 3)}}, {}, {0.5, -0.0}, Mat3::Identity()};
    w.parts = {Part{1, {}}, Part{2, {Vec3(4, 5, 6), Vec3(7, 8, 9)}}};
    return w;
}

}  // namespace

TEST(State, IsReadBackToTheBit) {
    const Whole before = some();
    Whole after;
    after.parts.resize(5);
    restore_state(after, state_of(before));
    EXPECT_EQ(state_of(after), state_of(before));
    EXPECT_EQ(state_hash_of(after), state_hash_of(before));
    EXPECT_EQ(after.name, "a wire");
    ASSERT_TRUE(after.part);
    EXPECT_EQ(after.part->places[0], Vec3(1, 2, 3));
    EXPECT_EQ(after.parts[1].places[1], Vec3(7, 8, 9));
    EXPECT_TRUE(std::signbit(after.pair[1]));
    EXPECT_EQ(after.made_again, 1);
}

TEST(State, EveryFieldChangesTheHash) {
    const std::uint64_t hash = state_hash_of(some());
    const auto changed = [&](auto change) {
        Whole w = some();
        change(w);
        return state_hash_of(w) != hash;
    };
    EXPECT_TRUE(changed([](Whole& w) { ++w.count; }));
    EXPECT_TRUE(changed([](Whole& w) { w.flag = false; }));
    EXPECT_TRUE(changed([](Whole& w) { w.kind = Kind::one; }));
    EXPECT_TRUE(changed([](Whole& w) { w.name += '\0'; }));
    EXPECT_TRUE(changed([](Whole& w) { w.part.reset(); }));
    EXPECT_TRUE(changed([](Whole& w) { w.part->weight = std::nextafter(0.1, 1.0); }));
    EXPECT_TRUE(changed([](Whole& w) { w.parts.pop_back(); }));
    EXPECT_TRUE(changed([](Whole& w) { w.pair[1] = 0.0; }));
    EXPECT_TRUE(changed([](Whole& w) { w.matrix(2, 1) = 1e-300; }));
    EXPECT_FALSE(changed([](Whole& w) { w.made_again = 1; }));
}

TEST(State, OfSomethingElseIsRefused) {
    std::vector<std::byte> state = state_of(some());
    Whole w;
    state.push_back({});
    EXPECT_THROW(restore_state(w, state), std::runtime_error);
    state.resize(state.size() / 2);
    EXPECT_THROW(restore_state(w, state), std::runtime_error);
    EXPECT_THROW(restore_state(w, std::vector<std::byte>(200, std::byte{0xff})), std::runtime_error);
}

TEST(Hash, WordsAndTheirOrderCount) {
    const auto of = [](auto... words) {
        Hash hash;
        (hash.add(words), ...);
        return hash.value();
    };
    EXPECT_NE(of(1.0, 2.0), of(2.0, 1.0));
    EXPECT_NE(of(0.0), of(-0.0));
    EXPECT_NE(of(0.0), of(0.0, 0.0));
    // One bit of the input changes about half of the hash's bits.
    for (int bit = 0; bit < 64; ++bit) {
        const int turned =
            std::popcount(of(std::uint64_t{12345}) ^ of(std::uint64_t{12345} ^ (std::uint64_t{1} << bit)));
        EXPECT_GT(turned, 12) << bit;
        EXPECT_LT(turned, 52) << bit;
    }
}

}  // namespace geometry
