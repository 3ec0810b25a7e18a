/// state_fuzz FRAMES [FIRST_SEED] [FOLDER]: plays random cases until so many frames have been played. A case
/// that breaks is left in the folder as SEED.toml and SEED.gw. Exit code 1 when any did.
///
/// state_fuzz hands COURSES [FIRST_SEED]: hands at the speeds of the room's keys in all scenarios that ship.
///
/// state_fuzz pushes COUNT [FIRST_SEED]: pushes of one segment through random tubes as in `study robustness`,
/// but with EI from 0.5 N·mm² and k to 1e4 N/mm. Exit code 1 when any does not end at rest.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <string>
#include <unistd.h>

#include "engine/studies/wild_hands.h"
#include "tests/fuzz/states.h"

namespace {

constexpr double longest_push = 60;  // that is not remarked upon [ms]

double resident_MB() {
    std::ifstream file("/proc/self/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

int push_wires(int wanted, long long first) {
    studies::TubeCourse sum;
    auto seed = static_cast<std::uint64_t>(first);
    double refused_for = 0;  // the longest [ms]
    for (; sum.pushes < wanted; ++seed) {
        const studies::TubeCourse c = studies::push_through(seed, wanted - sum.pushes, studies::harsh_tubes);
        sum.pushes += c.pushes, sum.unconverged += c.unconverged, sum.restless += c.restless;
        sum.refused += c.refused, sum.gave_way += c.gave_way, sum.flat += c.flat;
        sum.times.insert(sum.times.end(), c.times.begin(), c.times.end());
        for (std::size_t k = 0; k < c.times.size(); ++k)
            if (c.times[k] > longest_push)
                fmt::print("seed {}, push {}: {:.1f} ms; k λ³/EI {:.0f}, {} segments\n", seed, k, c.times[k],
                           c.tube.wall_stiffness * std::pow(c.tube.segment_length, 3) / c.tube.rigidity,
                           studies::segments_at_start + static_cast<int>(k));
        if (c.refused + c.gave_way > 0) refused_for = std::max(refused_for, c.times.back());
        for (const studies::Incident& i : c.incidents)
            fmt::print("seed {}, push {}: {}, {:.1f} ms\n", i.seed, i.at, i.what,
                       c.times[static_cast<std::size_t>(i.at)]);
    }
    std::sort(sum.times.begin(), sum.times.end());
    const auto time = [&](double fraction) {
        return sum.times[static_cast<std::size_t>(fraction * static_cast<double>(sum.times.size() - 1))];
    };
    fmt::print(
        "{} pushes, seeds {} to {}: {} not at rest, {} with |g|/C above {:g}, {} at rest but not shown to be "
        "minima; {} refused and {} more where the wall gives way, the longest {:.1f} ms; processor time "
        "median {:.3f}, 99 % {:.2f}, 99.9 % {:.1f}, longest {:.1f} ms\n",
        sum.pushes, first, seed - 1, sum.unconverged, sum.restless, studies::rest_limit, sum.flat,
        sum.refused, sum.gave_way, refused_for, time(0.5), time(0.99), time(0.999), time(1));
    return sum.unconverged + sum.restless > 0;
}

int play_courses(int courses, long long first) {
    const int broken = fuzz::play_hands(courses, static_cast<std::uint64_t>(first),
                                        [](const std::string& name, int played, const std::string& what) {
                                            fmt::print("{}: {} courses\n{}", name, played, what);
                                            std::fflush(stdout);
                                        });
    fmt::print("{} courses from seed {}, {} broken\n", courses, first, broken);
    return broken > 0;
}

}  // namespace

int main(int count, char** words) {
#ifdef NDEBUG
    fmt::print(stderr,
               "state_fuzz: expected a build with assertions, found one without; "
               "./app/build.sh checked state_fuzz makes one\n");
    return 2;
#endif
    const std::string what = count > 2 ? words[1] : "";
    const bool hands = what == "hands", pushes = what == "pushes";
    if (count < 2 || std::atoll(words[hands || pushes ? 2 : 1]) < 1) {
        fmt::print(stderr,
                   "state_fuzz FRAMES [FIRST_SEED] [FOLDER]\nstate_fuzz hands COURSES [FIRST_SEED]\n"
                   "state_fuzz pushes COUNT [FIRST_SEED]\n");
        return 2;
    }
    const long long first = hands || pushes ? (count > 3 ? std::atoll(words[3]) : 1) : 0;
    if (hands) return play_courses(std::atoi(words[2]), first);
    if (pushes) return push_wires(std::atoi(words[2]), first);
    const long long wanted = std::atoll(words[1]);
    std::uint32_t seed = count > 2 ? static_cast<std::uint32_t>(std::atoll(words[2])) : 1;
    const std::filesystem::path folder = count > 3 ? words[3] : "broken-states";
    long long played = 0, next = 0;
    int cases = 0, refused = 0, broken = 0;
    while (played < wanted) {
        const fuzz::StateCase made = fuzz::random_case(seed, 400);
        fuzz::StateOutcome outcome;
        try {
            outcome = fuzz::play(made);
        } catch (const std::exception& error) {
            outcome.broken = fmt::format("an exception: {}", error.what());
        }
        ++cases;
        refused += !outcome.refused.empty();
        played += outcome.frames;
        if (!outcome.broken.empty()) {
            ++broken;
            std::filesystem::create_directories(folder);
            std::ofstream(folder / fmt::format("{}.toml", seed)) << made.scenario;
            std::ofstream(folder / fmt::format("{}.gw", seed)) << made.script;
            fmt::print("seed {}: {}\n", seed, outcome.broken);
        }
        if (played >= next) {
            fmt::print("{} frames, {} cases, {} refused, {} broken, {:.0f} MB resident\n", played, cases,
                       refused, broken, resident_MB());
            std::fflush(stdout);
            next += wanted / 20;
        }
        ++seed;
    }
    fmt::print("{} frames, {} cases up to seed {}, {} refused, {} broken, {:.0f} MB resident\n", played,
               cases, seed - 1, refused, broken, resident_MB());
    return broken > 0;
}
