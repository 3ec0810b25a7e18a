/// `seldinger plan`: courses that reach a target, found by search, and which devices they need.

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/json.h"
#include "app/played_attempt.h"
#include "engine/anatomy/anatomy.h"
#include "engine/io/files.h"
#include "engine/plan/plan.h"
#include "engine/plan/report.h"
#include "engine/scenario/placement.h"

namespace app {
namespace {

namespace fs = std::filesystem;

struct PlanArguments {
    ScenarioChoice scenario;
    std::string to, from, devices = "own", exchange, out, cache;
    std::vector<fs::path> folders;  // of shards to merge
    std::optional<std::string> shard;
    int threads = 2, restarts = 2;
    std::uint64_t seed = 1;
    long frames = 40'000;
    std::optional<double> time_limit, most_force;
    std::optional<int> most_turns;
};

constexpr const char* candidates_folder = "candidates";

fs::path file_of(const fs::path& out, const std::string& name) {
    return out / candidates_folder / (io::file_name_of(name) + ".json");
}

/// The case of the arguments, without devices of its own.
plan::CaseText case_of(const PlanArguments& arguments, const anatomy::ModelCache& cache) {
    const fs::path named = arguments.scenario.named;
    const bool is_vessels = arguments.scenario.named.ends_with(".anatomy.json");
    fs::path file = named;
    if (!is_vessels) {
        file = exercise_named(arguments.scenario).file;
        static_cast<void>(load_exercise(file));
    }
    return plan::with_ends(
        plan::with_patient(plan::case_of(file, "glide035"), arguments.scenario.patient, catalogue()),
        arguments.to, arguments.from, catalogue(), cache);
}

/// What was made before, of the same case.
std::optional<plan::Planned> made_before(const fs::path& file, const std::string& identity) {
    std::error_code ignored;
    if (!fs::exists(file, ignored)) return std::nullopt;
    try {
        plan::Planned known = plan::planned_from(
            io::read_text(file, "candidate", "expected what 'plan' writes"), file.string());
        if (known.identity == identity && !known.stopped) return known;
    } catch (const io::InputError&) {
        // It is made again.
    }
    return std::nullopt;
}

/// Page, tables, and the best course as an exercise with its solution.
void write_plan(std::vector<plan::Planned>& all, const PlanArguments& arguments,
                const plan::PlanOptions& options) {
    const fs::path out = arguments.out;
    plan::rank(all);
    // Nothing that was asked for could begin.
    if (!all.front().refused.empty()) throw io::InputError(all.front().refused);
    // Those of a share's first, which is not the first of all.
    for (std::size_t k = 1; k < all.size(); ++k) {
        if (all[k].sensitivities.empty()) continue;
        all[k].sensitivities.clear();
        io::write_whole(file_of(out, all[k].name), plan::to_json(all[k]));
    }
    plan::add_sensitivities(all, options);
    plan::ReportCase of;
    const plan::Planned& first = all.front();
    const scenario::Scenario scenario =
        scenario::parse_scenario(first.scenario, out / "best.toml", options.catalogue);
    of.title = scenario.title;
    of.program = fmt::format("{}; {} sets of devices; {}", program, all.size(), first.settings);
    of.vessels = scenario::anatomy_of(scenario, options.cache);
    const auto end = anatomy::find_end(of.vessels, scenario.entry.end);
    if (end) of.entry = of.vessels.ends[static_cast<std::size_t>(*end)].opening.centre;
    of.target = scenario::target_of(scenario, of.vessels);
    of.target_radius = scenario.target.radius;
    of.risks = plan::risks(of.vessels, of.entry, of.target, 2 * scenario.thickest_radius());
    of.views = plan::views_on_way(scenario, of.vessels, options.cache);
    of.pictures = plan::pictures_of(scenario, of.vessels, of.views, options.cache);
    of.not_tried = {
        "Other devices than those in the table, other accesses, and other shapes of a tip.",
        "Treatment, and other balloons or stents of the tray: a course brings a device to the target.",
        "Amounts finer than the search's: pushes of 2 mm a frame, turns in steps of 45 degrees.",
        fmt::format("More than was asked for: {}.", first.settings)};
    for (const plan::Planned& one : all)
        for (const std::string& sentence : one.not_tried)
            of.not_tried.push_back(fmt::format("{}: {}.", one.name, sentence));
    const std::string page = plan::report(of, all), csv = plan::to_csv(all),
                      json = plan::plan_json(all, program);
    std::vector<std::pair<fs::path, std::string_view>> files = {
        {out / "plan.html", page}, {out / "plan.csv", csv}, {out / "plan.json", json}};
    if (first.reached) {
        files.emplace_back(out / "best.toml", first.scenario);
        files.emplace_back(out / "best.gw", first.course);
    }
    io::write_whole(files);
    // Those of an earlier plan would be taken for this one's.
    std::error_code ignored;
    if (!first.reached)
        for (const char* name : {"best.toml", "best.gw"}) fs::remove(out / name, ignored);
    // What depends on the first is kept with it.
    io::write_whole(file_of(out, first.name), plan::to_json(first));
}

void print_plan(const std::vector<plan::Planned>& all) {
    print("{:<28} {:>7} {:>9} {:>9} {:>8} {:>6} {:>8} {:>7}\n", "devices", "reached", "off by 5%", "at keys",
          "force", "turns", "travel", "time");
    for (const plan::Planned& one : all) {
        if (!one.refused.empty()) {
            print("{:<28} not possible: {}\n", one.name, one.refused);
            continue;
        }
        if (!one.reached) {
            print("{:<28} {:>7} nearest {:.0f} mm{}", one.name, "no", std::abs(one.left),
                  one.stopped ? ", time was up" : "");
            if (!one.failures.empty()) {
                const plan::Failure& why = one.failures.front();
                print("; the {} {} in {} at {:.0f} mm", script::name_of(why.device),
                      plan::ending_names[static_cast<std::size_t>(why.ending)], why.branch, why.along);
            }
            print("\n");
            continue;
        }
        print("{:<28} {:>7} {:>9} {:>9} {:>6.2f} N {:>6} {:>5.0f} mm {:>5.1f} s{}\n", one.name,
              one.within_limits ? "yes" : "limit", fmt::format("{}/{}", one.hands_reach, one.hands),
              fmt::format("{}/{}", one.played_reach, one.played), one.peak_force, one.turns, one.travel,
              one.seconds, one.stopped ? " (time was up)" : "");
    }
}

constexpr const char* share_file = "shard.json";

/// Which share of which list a folder holds.
std::string share_text(const std::string& shard, const std::vector<plan::Candidate>& all,
                       const plan::CaseText& text, const plan::PlanOptions& options) {
    Json devices = Json::array();
    for (const plan::Candidate& one : all) devices.push_back(one.name.empty() ? "own" : one.name);
    return Json{{"schema", 1},
                {"shard", shard},
                {"devices", devices},
                {"case", plan::identity_of(text, {}, options)}}
               .dump() +
           "\n";
}

/// Throws InputError unless the folders are all shares of one list, each once.
void require_whole(const std::vector<fs::path>& folders, const std::vector<plan::Planned>& all) {
    std::optional<Json> first;
    for (const fs::path& folder : folders) {
        const fs::path file = folder / share_file;
        const std::string text = io::read_text(file, "share", "expected a folder of 'plan --shard'");
        const Json share = Json::parse(text, nullptr, false);
        if (share.is_discarded() || !share.is_object() || !share.contains("devices") ||
            !share.contains("case"))
            throw io::InputError("{}: expected what 'plan --shard' writes", file.string());
        if (first && (share["case"] != (*first)["case"] || share["devices"] != (*first)["devices"]))
            throw io::InputError("{}: expected shares of one plan, found another's than in {}", file.string(),
                                 folders.front().string());
        first = share;
    }
    for (const plan::Planned& one : all)
        if (std::ranges::find((*first)["devices"], Json(one.name)) == (*first)["devices"].end())
            throw io::InputError(
                "merge: expected the sets of devices of one plan, found '{}', which an earlier one "
                "has left",
                one.name);
    for (const Json& name : (*first)["devices"])
        if (std::ranges::none_of(all, [&](const plan::Planned& one) { return one.name == name; }))
            throw io::InputError("merge: expected all shares, found none with '{}'", name.get<std::string>());
}

int merge(const PlanArguments& arguments, const plan::PlanOptions& options) {
    if (arguments.shard)
        throw BadArgument(
            "--shard: expected it with a scenario, found it with 'merge', which takes all shards");
    if (arguments.folders.empty()) throw BadArgument("merge: expected the folders of all shards, found none");
    std::vector<plan::Planned> all;
    for (const fs::path& folder : arguments.folders) {
        const fs::path candidates = folder / candidates_folder;
        std::error_code error;
        std::vector<fs::path> files;
        for (const fs::directory_entry& entry : fs::directory_iterator(candidates, error))
            if (entry.path().extension() == ".json") files.push_back(entry.path());
        if (error || files.empty())
            throw io::InputError("{}: expected candidates of a plan in it, found none", candidates.string());
        std::ranges::sort(files);
        for (const fs::path& file : files) {
            plan::Planned one = plan::planned_from(
                io::read_text(file, "candidate", "expected what 'plan' writes"), file.string());
            for (const plan::Planned& other : all)
                if (other.name == one.name)
                    throw io::InputError("{}: expected each set of devices once, found '{}' twice",
                                         file.string(), one.name);
            all.push_back(std::move(one));
        }
    }
    require_whole(arguments.folders, all);
    io::OwnFolder own(arguments.out);
    own.make(candidates_folder);
    own.keep();
    for (const plan::Planned& one : all)
        io::write_whole(file_of(arguments.out, one.name), plan::to_json(one));
    write_plan(all, arguments, options);
    print_plan(all);
    print("{}/plan.html\n", arguments.out);
    return all.front().reached ? done : not_reached;
}

int make_plan(const PlanArguments& arguments) {
    plan::PlanOptions options;
    options.search.threads = arguments.threads;
    options.search.seed = arguments.seed;
    options.search.restarts = arguments.restarts;
    options.search.most_frames = arguments.frames;
    options.speeds = key_speeds();
    options.cache.folder = usual_cache(arguments.cache);
    options.catalogue = catalogue();
    const script::Origin self = origin();
    options.program = fmt::format("{} {:016x}", program, self.program_hash);
    options.most_force = arguments.most_force;
    options.most_turns = arguments.most_turns;
    options.stop = stop_requested;
    const auto begun = std::chrono::steady_clock::now();
    options.time_is_up = [&] {
        return arguments.time_limit &&
               std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count() >
                   *arguments.time_limit;
    };
    std::vector<plan::Planned> all;
    int before = 0;
    try {
        ProgressBar bar;
        report_on(bar, options.cache);
        if (arguments.scenario.named == "merge") return merge(arguments, options);
        if (!arguments.folders.empty())
            throw BadArgument(
                "expected no more arguments after a scenario, found '{}'; 'plan merge' takes "
                "folders",
                arguments.folders.front().string());
        const plan::CaseText text = case_of(arguments, options.cache);
        const scenario::Scenario scenario = scenario::parse_scenario(text.toml, text.file, options.catalogue);
        std::vector<io::Output> outputs;
        for (const char* name : {"plan.html", "plan.csv", "plan.json", "best.toml", "best.gw"})
            outputs.push_back({"--out", fs::path(arguments.out) / name});
        scenario::require_no_input(outputs, scenario, {text.file});
        options.search.wires = plan::wires_of(arguments.exchange, scenario, options.catalogue);
        std::vector<plan::Candidate> candidates =
            plan::candidates_of(arguments.devices, scenario, options.catalogue);
        std::string share;
        if (arguments.shard) {
            share = share_text(*arguments.shard, candidates, text, options);
            const io::Shard shard = io::parse_shard(*arguments.shard);
            std::vector<plan::Candidate> own;
            for (std::size_t k = 0; k < candidates.size(); ++k)
                if (static_cast<int>(k) % shard.count + 1 == shard.index) own.push_back(candidates[k]);
            if (own.empty())
                throw BadArgument("--shard {}: expected at most {} shards, one for each set of devices",
                                  *arguments.shard, candidates.size());
            candidates = std::move(own);
        }
        io::OwnFolder own(arguments.out);
        own.make(candidates_folder);
        own.keep();
        const fs::path share_at = fs::path(arguments.out) / share_file;
        if (std::error_code ignored; share.empty())
            fs::remove(share_at, ignored);
        else
            io::write_whole(share_at, share);
        for (std::size_t k = 0; k < candidates.size(); ++k) {
            options.progress = [&](double part, const std::string& doing) {
                bar.show((static_cast<double>(k) + part) / static_cast<double>(candidates.size()), doing);
            };
            const std::string name = candidates[k].name.empty() ? "own" : candidates[k].name;
            const fs::path file = file_of(arguments.out, name);
            if (auto known = made_before(file, plan::identity_of(text, candidates[k], options))) {
                all.push_back(std::move(*known));
                ++before;
                continue;
            }
            all.push_back(plan::plan(text, candidates[k], options));
            io::write_whole(file, plan::to_json(all.back()));
        }
        write_plan(all, arguments, options);
    } catch (const plan::Stopped&) {
        tell("interrupted: the same command goes on\n");
        return interrupted;
    }
    print_plan(all);
    if (before > 0) print("{} of {} made before\n", before, all.size());
    print("{}/plan.html\n", arguments.out);
    return all.front().reached ? done : not_reached;
}

}  // namespace

Command add_plan(CLI::App& parser) {
    const auto arguments = std::make_shared<PlanArguments>();
    CLI::App* command = parser.add_subcommand(
        "plan",
        "Find courses that reach a target, and which devices they need\n\n"
        "Examples:\n"
        "  seldinger plan renal --out plan                        with the exercise's own devices\n"
        "  seldinger plan renal --devices wires,glide035+cobra5f --out plan\n"
        "  seldinger plan renal_right --devices glidestraight035+vertebral5f --exchange glide035 --out plan\n"
        "  seldinger plan mine.anatomy.json --to LRA:20 --from LCFA.out --devices glide035 --out plan");
    command
        ->add_option("scenario", arguments->scenario.named,
                     "A scenario (.toml), the name of an exercise, or vessels (.anatomy.json); or 'merge'")
        ->required()
        ->type_name("SCENARIO");
    command->add_option("folders", arguments->folders, "Of 'merge': those of all shards")
        ->type_name("FOLDER");
    add_exercises(command, arguments->scenario.exercises);
    add_patient(command, arguments->scenario);
    command
        ->add_option("--to", arguments->to,
                     "Another target: the name of one, a branch, 'BRANCH:20' 20 mm along it, or 'x,y,z' [mm]")
        ->type_name("TARGET");
    command->add_option("--from", arguments->from, "Another entry: an open end of the vessels")
        ->type_name("END");
    command
        ->add_option(
            "--devices", arguments->devices,
            "What to try, with commas; devices in each other are joined by +, a wire first. 'own': as "
            "the scenario has them; 'wires': every wire of the catalogue that is as thick as its wire")
        ->type_name("LIST")
        ->capture_default_str();
    command
        ->add_option(
            "--exchange", arguments->exchange,
            "Wires of the catalogue, with commas, that the wire may be exchanged for through a catheter; "
            "'wires' as above")
        ->type_name("LIST");
    command
        ->add_option("--out", arguments->out, "Folder for plan.html, plan.csv, plan.json, best.toml, best.gw")
        ->required()
        ->type_name("FOLDER");
    command
        ->add_option("--threads", arguments->threads, "Moves tried at a time; the plan does not depend on it")
        ->check(whole_number(1, 256))
        ->capture_default_str();
    command->add_option("--seed", arguments->seed, "Of the angles that are tried again")
        ->capture_default_str();
    command->add_option("--restarts", arguments->restarts, "With other angles, where nothing was found")
        ->check(whole_number(0, 100))
        ->capture_default_str();
    command->add_option("--frames", arguments->frames, "To simulate at most, for each set of devices")
        ->check(whole_number(1000, 100'000'000))
        ->capture_default_str();
    add_optional(command, "--time-limit", arguments->time_limit,
                 "The search ends after this time with the best so far, which is marked [s]")
        ->check(number(1, 1e7));
    add_optional(command, "--most-force", arguments->most_force,
                 "Courses that press one place of the wall by more come last [N]")
        ->check(number(0.001, 1000));
    add_optional(command, "--most-turns", arguments->most_turns, "Courses with more turns of a hub come last")
        ->check(whole_number(0, 1000));
    add_optional(command, "--shard", arguments->shard,
                 "i/n: only the i-th of n shares of the devices, for another machine and 'merge'")
        ->type_name("i/n")
        ->check(shard());
    add_cache_folder(command, arguments->cache);
    command->footer(
        "The search plays pushes, pulls and turns in the simulation and goes back to states that it kept.\n"
        "The same command goes on where one was interrupted, and makes only what is missing or has changed.\n"
        "Exit codes: 0 a course reaches the target, 1 none was found, 2 bad input, 130 interrupted.");
    return {command, [arguments] { return make_plan(*arguments); }};
}

}  // namespace app
