/// Random courses of runs and of attempts in the room while files cannot be written, disks are full,
/// processes are killed, the cache is damaged, clocks jump, and threads and processes take turns by lot. One
/// seed decides all of a course: `fault_simulator SEED` plays the same one again.

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <sys/stat.h>
#include <vector>

#include "engine/exercise/exercise.h"
#include "engine/exercise/observation.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/room/attempts.h"
#include "engine/run/headless.h"
#include "engine/scenario/scenario.h"
#include "physics/geometry/hash.h"
#include "tests/fuzz/fault_world.h"
#include "tests/fuzz/states.h"

namespace {

namespace fs = std::filesystem;
using fuzz::Accidents;
using fuzz::Ended;
using fuzz::Fault;
using fuzz::Played;
using Files = std::map<std::string, std::string>;  // bytes by path, or what else stands there

constexpr const char* devices = SELDINGER_SOURCE "/assets/devices";

class Dice {
public:
    explicit Dice(std::uint64_t seed) : random_(seed) {}
    std::int64_t below(std::int64_t n) {
        return n <= 0 ? 0 : static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(n));
    }
    bool one_in(int n) { return below(n) == 0; }
    std::uint64_t bits() { return random_(); }
    template <class Thing>
    const Thing& of(const std::vector<Thing>& things) {
        return things[static_cast<std::size_t>(below(static_cast<std::int64_t>(things.size())))];
    }

private:
    std::mt19937_64 random_;
};

std::string bytes_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

Files files_in(const fs::path& folder) {
    Files found;
    std::error_code failed;
    for (fs::recursive_directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
        const fs::file_status status = entry->symlink_status();
        if (fs::is_directory(status)) continue;
        const std::string name = entry->path().lexically_relative(folder).string();
        found[name] = fs::is_symlink(status)        ? "a link to " + fs::read_symlink(entry->path()).string()
                      : fs::is_regular_file(status) ? bytes_of(entry->path())
                                                    : "a device";
    }
    return found;
}

bool is_unfinished(const std::string& name) {
    return name.find(".part") != std::string::npos || name.ends_with(".lock");
}

/// Whether the file grows while it is written.
bool grows(const std::string& name) {
    return name.ends_with(".gw") || name.ends_with(".csv");
}
/// Whether there is a recording to replay: a program that was killed at once has left none.
bool is_begun(const std::string& recording) {
    return recording.find('\n') != std::string::npos;
}

struct Totals {
    int courses = 0, refused = 0, broken = 0, processes = 0, kills = 0, faults = 0, damages = 0, replays = 0,
        runs = 0, attempts = 0, side_by_side = 0;
};

class Course {
public:
    Course(std::uint64_t seed, fs::path folder, Totals& totals)
        : dice_(seed), folder_(std::move(folder)), totals_(totals), world_(folder_) {
        const int frames = static_cast<int>(8 + dice_.below(40));
        do case_ = fuzz::random_case(static_cast<std::uint32_t>(dice_.bits()), frames);
        while (case_.scenario.find("[tube]") == std::string::npos &&
               !dice_.one_in(4));  // trees take a second
        other_ = fuzz::random_case(case_.seed, frames / 2);
        // A body takes a second to make; vessels that move need one.
        if (!dice_.one_in(4) && case_.scenario.find("[motion]") == std::string::npos)
            case_.scenario += "[imaging]\npatient = false\n";
    }

    void play() {
        if (dice_.one_in(4))
            play_attempts();
        else
            play_runs();
        log("{}", broken_.empty() ? refused_ ? "refused" : "held" : broken_);
    }
    const std::string& text() const { return log_; }
    const std::string& broken() const { return broken_; }

private:
    template <class... Values>
    void log(fmt::format_string<Values...> text, Values&&... values) {
        log_ += fmt::format(text, std::forward<Values>(values)...) + "\n";
    }
    /// The first thing that did not hold ends the course.
    struct Broke {};
    template <class... Values>
    [[noreturn]] void broke(fmt::format_string<Values...> text, Values&&... values) {
        broken_ = without_folder(fmt::format(text, std::forward<Values>(values)...));
        throw Broke();
    }

    std::string without_folder(std::string text) const {
        for (std::size_t at; (at = text.find(folder_.string())) != std::string::npos;)
            text.replace(at, folder_.string().size(), "@");
        return text;
    }

    // What is played.

    struct Outputs {
        bool images = false, panel = false, truth = false, dicom = false, slicer = false, trace = false;
        bool dose = false;
        int every = 1;
    };

    scenario::Scenario scenario() const {
        return scenario::parse_scenario(case_.scenario, (folder_ / "random.toml").string(), devices);
    }
    /// Throws std::logic_error for a sentence without a path of the world and a reason.
    void require_reason(const std::string& said) const {
        for (const int reason :
             {ENOSPC, EACCES, EIO, EMFILE, EROFS, EDQUOT, EFBIG, EBUSY, ENOLCK, EINTR, ENOTSUP, EISDIR})
            if (said.find(std::strerror(reason)) != std::string::npos &&
                said.find(folder_.string()) != std::string::npos)
                return;
        if (said.find("process") != std::string::npos && said.find("is writing") != std::string::npos) return;
        throw std::logic_error("no path and reason: " + said);
    }
    anatomy::ModelCache cache(const fs::path& place) const {
        return {place / "cache", {}, [this](const std::string& said) { require_reason(said); }};
    }

    void run(const std::string& script, const fs::path& place, const std::string& out) const {
        run::RunOptions options;
        options.images = outputs_.images;
        options.dose = outputs_.dose;
        options.panel = outputs_.panel;
        options.truth = outputs_.truth;
        if (outputs_.dicom) options.dicom = dicom::Pixels::Shown;
        options.slicer = outputs_.slicer;
        if (outputs_.trace) options.trace = place / (out + ".csv");
        options.every = outputs_.every;
        options.hash_every = 5;
        options.origin.program = "fault_simulator";
        options.cache = cache(place);
        options.observer = [](const exercise::Frame&, exercise::Exercise& exercise) {
            fuzz::FaultWorld::tell_state(exercise.simulation().state_hash());
        };
        run::run_headless(scenario(), script::parse_commands(script, (folder_ / "random.gw").string()),
                          place / out, options);
    }

    void replay(const fs::path& recording, const fs::path& place) const {
        run::RunOptions options;
        options.images = options.dose = false;
        options.same_origin = true;
        options.cache = cache(place);
        const script::CommandScript script = script::load_commands(recording);
        const run::RunResult result = run::run_headless(scenario(), script, options);
        if (!result.differences.empty()) throw std::logic_error(result.differences.front());
    }

    /// As the room does it: an attempt with seconds that are taken back and comments.
    void attempt(const fs::path& place) const {
        const scenario::Scenario here = scenario();
        const script::CommandScript script = script::parse_commands(case_.script, "random.gw");
        exercise::Exercise exercise(here, outputs_.dose ? exercise::Pictures::Dose : exercise::Pictures::None,
                                    cache(place), &script);
        script::RecordingHeader header;
        header.origin.program = "fault_simulator";
        header.origin.free_practice = true;
        header.hash_every = 5;
        exercise::identify(header.origin, exercise.simulation());
        room::AttemptRecording recording([this](const std::string& said) { require_reason(said); });
        recording.begin(room::Attempts(place / "attempts"), here.name, header);
        const auto hash = [&] { return exercise.simulation().state_hash(); };
        exercise::Exercise::Snapshot moment;
        int remembered = -1, ahead = 0;
        for (int step = 0; step < 2 * case_.frames; ++step) {
            const int frame = exercise.frame() + 1;
            std::vector<script::Command> commands;
            for (const script::TimedCommand& timed : script.at((frame + ahead) % case_.frames))
                if (ahead == 0 || std::holds_alternative<script::Advance>(timed.command) ||
                    std::holds_alternative<script::Withdraw>(timed.command) ||
                    std::holds_alternative<script::Rotate>(timed.command))
                    commands.push_back(script::canonical(timed.command));
            exercise.next_frame(commands);
            recording.frame(frame, commands, hash);
            fuzz::FaultWorld::tell_state(hash());
            if (step % 7 == 3) {
                moment = exercise.snapshot();
                remembered = frame;
            }
            if (step % 11 == 5) recording.comment({frame, "well done"});
            if (step % 13 == 10 && remembered >= 0) {
                exercise.restore(moment);
                recording.take_back(remembered);
                remembered = -1;
                ++ahead;
            }
        }
        recording.close(hash);
    }

    // How it is played, and what must hold.

    std::int64_t any_call(std::int64_t calls) {
        // The first ones, which make and lock folders, as often as all others together.
        return dice_.one_in(2) ? dice_.below(std::min<std::int64_t>(calls, 30)) : dice_.below(calls);
    }
    Accidents accidents(std::int64_t calls) {
        Accidents drawn;
        drawn.seed = dice_.bits();
        drawn.noise = dice_.one_in(2) ? static_cast<int>(2 + dice_.below(30)) : 0;
        drawn.switches = dice_.of<int>({0, 2, 5, 30});
        drawn.jumps = dice_.of<int>({0, 0, 2, 10});
        drawn.processors = static_cast<int>(1 + dice_.below(4));
        drawn.begin = static_cast<double>(dice_.below(4'000'000'000));
        for (Fault& fault : drawn.faults) {
            using Kind = Fault::Kind;
            fault.kind =
                dice_.of<Kind>({Kind::None, Kind::None, Kind::None, Kind::Once, Kind::Once, Kind::Kill,
                                Kind::Kill, &fault == &drawn.faults.front() ? Kind::FullDisk : Kind::None,
                                &fault == &drawn.faults.front() ? Kind::ReadOnly : Kind::Once});
            fault.from = any_call(calls);
            const bool lasts = fault.kind == Kind::FullDisk || fault.kind == Kind::ReadOnly;
            fault.until = fault.from + (!lasts ? 1 : dice_.one_in(2) ? 1'000'000'000 : 1 + dice_.below(40));
        }
        return drawn;
    }
    /// Without accidents, but for the order of threads.
    Accidents quiet() {
        Accidents none;
        none.seed = dice_.bits();
        none.switches = 3;
        none.processors = static_cast<int>(1 + dice_.below(3));
        return none;
    }

    Played in_world(const std::string& what, const Accidents& accidents,
                    const std::vector<std::function<void()>>& acts) {
        Played played = world_.play(accidents, acts);
        log("{}: {} calls", what, played.calls);
        log_ += without_folder(played.log);
        totals_.faults += static_cast<int>(std::ranges::count(played.log, '\n'));
        totals_.processes += static_cast<int>(acts.size());
        for (const Ended& ended : played.processes) {
            constexpr const char* names[] = {"done", "refused", "threw", "killed"};
            geometry::Hash states;
            for (const std::uint64_t state : ended.states) states.add(state);
            log("{}: {}, {} states {} {}", what, names[static_cast<int>(ended.how)], ended.states.size(),
                io::hash_text(states.value()), without_folder(ended.said));
            totals_.kills += ended.how == Ended::How::Killed;
            if (!ended.broken.empty()) broke("{}: {}", what, ended.broken);
            if (ended.how == Ended::How::Threw) broke("{}: an exception: {}", what, ended.said);
        }
        return played;
    }
    /// One that must succeed.
    Ended undisturbed(const std::string& what, const std::function<void()>& act) {
        Played played = in_world(what, quiet(), {act});
        Ended& ended = played.processes.front();
        if (ended.how != Ended::How::Done)
            broke("{}, which nothing disturbed, was refused: {}", what, ended.said);
        return std::move(ended);
    }

    void require_states(const std::string& what, const Ended& ended) {
        const std::size_t count = std::min(ended.states.size(), states_.size());
        if (ended.states.size() > states_.size() ||
            !std::equal(ended.states.begin(), ended.states.end(), states_.begin()) ||
            (ended.how == Ended::How::Done && count != states_.size()))
            broke("{}: other states than without faults, among {} of {}", what, ended.states.size(),
                  states_.size());
        if (ended.how != Ended::How::Refused) return;
        try {
            require_reason(ended.said);
        } catch (const std::logic_error& error) {
            broke("{}: refused with {}", what, error.what());
        }
    }

    /// What has been left unfinished there, and in the folder for temporary files.
    std::set<std::string> unfinished(const fs::path& place) const {
        std::set<std::string> names;
        for (const auto& [name, bytes] : files_in(place))
            if (is_unfinished(name)) names.insert(name);
        for (const auto& entry : fs::directory_iterator(folder_ / "tmp")) names.insert(entry.path().string());
        return names;
    }
    /// Nothing but what was there: what a kill left is removed by the next run that gets so far.
    void require_nothing_left(const std::string& what, const fs::path& place,
                              const std::set<std::string>& before = {}) {
        for (const std::string& name : unfinished(place))
            if (!before.contains(name)) broke("{}: {} was left behind", what, name);
    }

    /// Every file is that of one of the runs, whole, or as far as it has grown.
    void require_whole(const std::string& what, const Files& found, const std::vector<const Files*>& wholes) {
        for (const auto& [name, bytes] : found) {
            if (is_unfinished(name)) continue;
            const bool whole = std::ranges::any_of(wholes, [&](const Files* files) {
                const auto at = files->find(name);
                return at != files->end() &&
                       (at->second == bytes || (grows(name) && at->second.starts_with(bytes)));
            });
            if (!whole)
                broke("{}: {} of {} bytes is neither the earlier file nor the new one", what, name,
                      bytes.size());
        }
    }
    void require_same(const std::string& what, const Files& found, const Files& expected) {
        for (const auto& [name, bytes] : expected) {
            const auto at = found.find(name);
            if (at == found.end()) broke("{}: {} is missing", what, name);
            if (at->second != bytes) broke("{}: {} has other bytes than undisturbed", what, name);
        }
        for (const auto& [name, bytes] : found)
            if (!expected.contains(name)) broke("{}: {} should not be there", what, name);
    }

    /// What may befall a cache while nobody uses it.
    void damage(const fs::path& cache) {
        std::vector<std::string> names;
        for (const auto& [name, bytes] : files_in(cache))
            if (!is_unfinished(name)) names.push_back(name);
        if (names.empty()) return;
        const fs::path file = cache / dice_.of(names);
        // What an earlier damage left may be no file, and could be waited for.
        std::string bytes = fs::is_regular_file(fs::symlink_status(file)) ? bytes_of(file) : std::string();
        const auto write = [&] {
            fs::remove_all(file);
            std::ofstream(file, std::ios::binary) << bytes;
        };
        const std::string behind = (folder_ / "behind").string();
        std::string how;
        switch (dice_.below(8)) {
            case 0:
                how = "cut";
                bytes.resize(
                    static_cast<std::size_t>(dice_.below(static_cast<std::int64_t>(bytes.size() + 1))));
                write();
                break;
            case 1:
                how = "longer";
                bytes += std::string(static_cast<std::size_t>(1 + dice_.below(5000)), 'x');
                write();
                break;
            case 2:
                how = "a FIFO";
                fs::remove_all(file);
                if (::mkfifo(file.c_str(), 0600) != 0) throw std::runtime_error("mkfifo");
                break;
            case 3:
                how = "a link to nothing";
                fs::remove_all(file);
                fs::create_symlink(folder_ / "nothing", file);
                break;
            case 4:
                how = "a link to another file";
                std::ofstream(behind, std::ios::binary) << "not of the cache";
                fs::remove_all(file);
                fs::create_symlink(behind, file);
                break;
            case 5:
                how = "a folder";
                fs::remove_all(file);
                fs::create_directory(file);
                std::ofstream(file / "something") << "else";
                break;
            default:
                how = "with other bits";
                for (auto flips = dice_.below(3) + 1; flips > 0 && !bytes.empty(); --flips)
                    bytes[static_cast<std::size_t>(dice_.below(static_cast<std::int64_t>(bytes.size())))] ^=
                        static_cast<char>(1 << dice_.below(8));
                write();
        }
        ++totals_.damages;
        log("damage: {} is {}", file.filename().string(), how);
    }

    void make_place(const fs::path& place) {
        fs::create_directories(place);
        fs::create_directories(folder_ / "tmp");
    }

    /// Whether the course without accidents is accepted; its states are known then.
    bool know_states(const std::function<void()>& act) {
        Played played = in_world("undisturbed", quiet(), {act});
        Ended& ended = played.processes.front();
        calls_ = played.calls;
        if (ended.how != Ended::How::Done) {
            refused_ = true;
            ++totals_.refused;
            return false;
        }
        states_ = std::move(ended.states);
        return true;
    }

    void play_runs() try {
        ++totals_.runs;
        outputs_.images = dice_.one_in(4);
        outputs_.panel = dice_.one_in(3);
        outputs_.truth = dice_.one_in(2);
        outputs_.dicom = dice_.one_in(2);
        outputs_.slicer = dice_.one_in(4);
        outputs_.trace = dice_.one_in(3);
        outputs_.dose = dice_.one_in(8);
        outputs_.every = static_cast<int>(1 + dice_.below(6));
        const fs::path alone = folder_ / "alone", place = folder_ / "place";
        make_place(alone);
        make_place(place);
        if (!know_states([&] { run(case_.script, alone, "out"); })) return;
        require_nothing_left("undisturbed", alone);
        const Files expected = files_in(alone / "out"), cached = files_in(alone / "cache");
        const std::string trace = bytes_of(alone / "out.csv");
        Files earlier;
        if (dice_.one_in(2)) {
            undisturbed("an earlier run", [&] { run(other_.script, place, "out"); });
            earlier = files_in(place / "out");
        }
        for (auto rounds = 1 + dice_.below(3); rounds > 0; --rounds) {
            if (dice_.one_in(2)) damage(place / "cache");
            const Files cache_before = files_in(place / "cache");
            const std::set<std::string> left_before = unfinished(place);
            const bool two = dice_.one_in(4), one_folder = two && dice_.one_in(2);
            totals_.side_by_side += two;
            const Accidents planned = accidents(calls_ * (two ? 2 : 1));
            std::vector<std::function<void()>> acts = {[&] { run(case_.script, place, "out"); }};
            if (two) acts.push_back([&] { run(case_.script, place, one_folder ? "out" : "beside"); });
            const Played played = in_world("disturbed", planned, acts);
            bool killed = false, done = false;
            for (const Ended& ended : played.processes) {
                require_states("disturbed", ended);
                killed |= ended.how == Ended::How::Killed;
                done |= ended.how == Ended::How::Done && (one_folder || &ended == &played.processes.front());
                if (ended.how == Ended::How::Refused && !one_folder &&
                    std::ranges::all_of(planned.faults,
                                        [](const Fault& fault) { return fault.kind == Fault::Kind::None; }))
                    broke("refused without a fault: {}", ended.said);
            }
            const Files out = files_in(place / "out");
            require_whole("disturbed", out, {&expected, &earlier});
            if (two && !one_folder) require_whole("beside", files_in(place / "beside"), {&expected});
            require_whole("the cache", files_in(place / "cache"), {&cached, &cache_before});
            if (!killed && !played.left_behind) require_nothing_left("disturbed", place, left_before);
            if (done && !one_folder && !killed) {
                Files finished = out;
                std::erase_if(finished, [](const auto& file) { return is_unfinished(file.first); });
                require_same("done", finished, expected);
            }
            if (fs::exists(folder_ / "behind") && bytes_of(folder_ / "behind") != "not of the cache")
                broke("what a link in the cache leads to was written to");
            // What has grown so far can be replayed.
            if (const auto at = out.find("run.gw"); at != out.end() && is_begun(at->second) && !done) {
                ++totals_.replays;
                undisturbed("the replay", [&] { replay(place / "out/run.gw", place); });
            }
        }
        if (dice_.one_in(3)) {
            damage(place / "cache");
            undisturbed("what must hold", [&] {
                const anatomy::ModelCache kept = cache(place);
                const fuzz::StateOutcome outcome = fuzz::play(case_, &kept);
                if (!outcome.broken.empty()) throw std::logic_error(outcome.broken);
            });
        }
        if (dice_.one_in(2)) damage(place / "cache");
        // What only the run beside it writes is not written, and so not cleared, by the last.
        std::vector<fs::path> beside;
        for (const auto& entry : fs::directory_iterator(place))
            if (entry.path().filename().string().starts_with("beside")) beside.push_back(entry.path());
        for (const fs::path& path : beside) fs::remove_all(path);
        const Ended last = undisturbed("the last run", [&] { run(case_.script, place, "out"); });
        require_states("the last run", last);
        require_nothing_left("the last run", place);
        require_same("the last run", files_in(place / "out"), expected);
        require_same("the cache of the last run", files_in(place / "cache"), cached);
        if (outputs_.trace && bytes_of(place / "out.csv") != trace) broke("the last run has another trace");
    } catch (const Broke&) {
        return;
    }

    void play_attempts() try {
        ++totals_.attempts;
        outputs_.dose = dice_.one_in(4);
        const fs::path alone = folder_ / "alone", place = folder_ / "place";
        make_place(alone);
        make_place(place);
        if (!know_states([&] { attempt(alone); })) return;
        for (auto rounds = 1 + dice_.below(4); rounds > 0; --rounds) {
            if (dice_.one_in(3)) damage(place / "cache");
            const Files before = files_in(place / "attempts");
            const bool two = dice_.one_in(3);
            totals_.side_by_side += two;
            const Accidents planned = accidents(calls_ * (two ? 2 : 1));
            std::vector<std::function<void()>> acts(two ? 2 : 1, [&] { attempt(place); });
            const Played played = in_world("disturbed", planned, acts);
            for (const Ended& ended : played.processes) {
                require_states("disturbed", ended);
                if (ended.how == Ended::How::Refused)
                    broke("a recording's fault ended an attempt: {}", ended.said);
            }
            const Files after = files_in(place / "attempts");
            for (const auto& [name, bytes] : before)
                if (!after.contains(name) || after.at(name) != bytes)
                    broke("disturbed: the earlier attempt {} has changed", name);
            for (const auto& [name, bytes] : after) {
                if (before.contains(name) || !is_begun(bytes)) continue;
                ++totals_.replays;
                undisturbed("the replay of " + name, [&] { replay(place / "attempts" / name, place); });
            }
        }
        const Files before = files_in(place / "attempts");
        require_states("the last attempt", undisturbed("the last attempt", [&] { attempt(place); }));
        require_nothing_left("the last attempt", place);
        const Files after = files_in(place / "attempts");
        if (after.size() != before.size() + 1) broke("the last attempt has no file of its own");
    } catch (const Broke&) {
        return;
    }

    Dice dice_;
    fs::path folder_;
    Totals& totals_;
    fuzz::FaultWorld world_;
    fuzz::StateCase case_, other_;
    Outputs outputs_;
    std::vector<std::uint64_t> states_;  // without faults
    std::int64_t calls_ = 0;             // for the file system, without faults
    bool refused_ = false;
    std::string log_, broken_;
};

struct Outcome {
    std::string log, broken;
    std::uint64_t hash() const {
        geometry::Hash hash;
        hash.add(log.data(), log.size());
        return hash.value();
    }
};

Outcome play(std::uint64_t seed, const fs::path& scratch, Totals& totals) {
    const fs::path folder = scratch / "course";
    fs::remove_all(folder);
    fs::create_directories(folder);
    for (const char* name : {"TMPDIR", "HOME"}) ::setenv(name, (folder / "tmp").c_str(), 1);
    Course course(seed, folder, totals);
    course.play();
    ++totals.courses;
    return {course.text(), course.broken()};
}

void print(const Totals& t) {
    fmt::print(
        "{} courses ({} of runs, {} of attempts, {} refused), {} processes ({} times two at a time), {} "
        "kills, "
        "{} faults, {} damages of a cache, {} replays: {} broken\n",
        t.courses, t.runs, t.attempts, t.refused, t.processes, t.side_by_side, t.kills, t.faults, t.damages,
        t.replays, t.broken);
    std::fflush(stdout);
}

}  // namespace

int main(int count, char** words) {
    const std::vector<std::string> given(words + 1, words + count);
    const bool timed = given.size() >= 2 && given[0] == "--minutes";
    const auto number = [&](std::size_t k, std::int64_t otherwise) -> std::int64_t {
        return k < given.size() ? io::parse_integer(given[k]).value_or(-1) : otherwise;
    };
    const std::int64_t minutes = timed ? number(1, 0) : 0, first = number(timed ? 2 : 0, timed ? 1 : -1),
                       courses = timed ? INT64_MAX : number(1, 1);
    if (minutes < 0 || first < 0 || courses < 1 || given.size() > (timed ? 3 : 2)) {
        fmt::print(stderr, "fault_simulator SEED [COUNT]\nfault_simulator --minutes MINUTES [SEED]\n");
        return 2;
    }
    ::setenv("LP_NUM_THREADS", "0", 1);
    ::setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
    ::setenv("SELDINGER_ASSETS", SELDINGER_SOURCE "/assets", 1);
    ::unsetenv("SELDINGER_CACHE_MB");
    const io::ScratchFolder scratch;
    const auto clock = [] { return std::chrono::steady_clock::now(); };
    const auto end = clock() + std::chrono::minutes(minutes);
    auto next = clock();
    Totals totals;
    for (std::int64_t k = 0; k < courses && (!timed || clock() < end); ++k) {
        const auto seed = static_cast<std::uint64_t>(first + k);
        Outcome outcome = play(seed, scratch.path(), totals);
        if (outcome.broken.empty() && k % 8 == 0) {
            Totals again;
            const Outcome second = play(seed, scratch.path(), again);
            if (second.log != outcome.log) {
                outcome.broken = "played again, it has another log";
                fmt::print("{}--- again:\n{}", outcome.log, second.log);
            }
        }
        if (!outcome.broken.empty()) {
            ++totals.broken;
            fmt::print("seed {}: {}\n    fault_simulator {}\n", seed, outcome.broken, seed);
            std::fflush(stdout);
        }
        if (courses == 1) fmt::print("{}", outcome.log);
        if (!timed) fmt::print("seed {}: log {}\n", seed, io::hash_text(outcome.hash()));
        if (timed && clock() > next) {
            next = clock() + std::chrono::minutes(1);
            fmt::print("up to seed {}: ", seed);
            print(totals);
        }
    }
    print(totals);
    return totals.broken > 0;
}
