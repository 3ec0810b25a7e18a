/// `seldinger bake`: makes ahead what environments that draw their patients need of each.

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/episode/store.h"
#include "engine/exercise/body.h"
#include "engine/exercise/transport.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace app {
namespace {

struct BakeArguments {
    ScenarioChoice vessels;  // a preset, or an exercise
    std::string seeds, cache, for_web;
    std::vector<int> images;  // pixels along a side
    std::vector<std::string> set;
    bool without_bodies = false;
};

struct SeedRange {
    std::uint64_t first = 0, end = 0;
};

constexpr std::uint64_t most = 100'000;

std::optional<SeedRange> seeds_of(const std::string& text) {
    SeedRange range;
    const char* const last = text.data() + text.size();
    const auto first = std::from_chars(text.data(), last, range.first);
    if (first.ec == std::errc() && first.ptr != last && *first.ptr == ':') {
        const auto end = std::from_chars(first.ptr + 1, last, range.end);
        if (end.ec == std::errc() && end.ptr == last && range.first < range.end &&
            range.end - range.first <= most && range.end <= std::uint64_t{9'000'000'000'000'000})
            return range;
    }
    return std::nullopt;
}

/// Whether the cache has the body now.
bool bake_body(const anatomy::Anatomy& vessels, const anatomy::ModelCache& cache) {
    static_cast<void>(exercise::body_around(vessels, cache));
    return exercise::body_is_kept(vessels, cache);
}

/// Vessels of a preset, their wall and body. Whether the cache has them now.
bool bake_preset(const BakeArguments& arguments, std::uint64_t seed, const anatomy::ModelCache& cache) {
    anatomy::VesselTreeSpec spec = anatomy::vessel_preset(arguments.vessels.named, seed);
    spec.name = anatomy::name_of_grown(spec.name, seed);
    const anatomy::Anatomy made = anatomy::generated_anatomy(spec, cache);
    static_cast<void>(anatomy::cached_distance_field(made, 1.0, 0.0, cache));
    const bool kept = anatomy::is_kept(spec, cache);
    return (arguments.without_bodies || bake_body(made, cache)) && kept;
}

/// In other vessels the place of a target may be outside: what has a name stands for it.
scenario::Scenario exercise_of(const BakeArguments& arguments, const std::filesystem::path& file,
                               std::uint64_t seed) {
    const auto with = [&](std::vector<std::pair<std::string, std::string>> values) {
        for (const scenario::Override& value : overrides_of(arguments.set))
            values.emplace_back(value.key, value.value);
        return episode::scenario_of({file.string(), {}, catalogue().string(), std::move(values)});
    };
    const std::pair<std::string, std::string> patient{"anatomy.seed", std::to_string(seed)};
    const scenario::Scenario found = with({patient});
    if (!found.target.centre || !found.vessels || found.vessels->targets.empty()) return found;
    return with({patient, {"target.name", io::toml_text(found.vessels->targets.front().name)}});
}

/// All that an episode of the exercise needs. Whether the cache has it now.
bool bake_exercise(const BakeArguments& arguments, const std::filesystem::path& file, std::uint64_t seed,
                   const anatomy::ModelCache& cache) {
    const scenario::Scenario scenario = exercise_of(arguments, file, seed);
    episode::Episode episode(scenario, exercise::Pictures::None, cache);
    bool kept = anatomy::is_kept(*scenario.vessels, cache);
    if (!arguments.without_bodies) kept = bake_body(episode.simulation().anatomy(), cache) && kept;
    const auto keep_views = [&] {
        for (const int pixels : arguments.images) kept = episode.keep_view(pixels) && kept;
    };
    keep_views();
    // Environments then move the table.
    const exercise::InImage tip = episode.reading().tip_px;
    const auto in_image = [&](double at) { return at >= 0 && at < scenario.c_arm.pixels; };
    if (!in_image(tip.x) || !in_image(tip.y)) {
        episode.show_tip(episode::Episode::usual_margin);
        keep_views();
    }
    return kept;
}

/// What bakes one seed.
std::function<bool(std::uint64_t, const anatomy::ModelCache&)> baker_of(const BakeArguments& arguments,
                                                                        std::uint64_t first) {
    const std::string& named = arguments.vessels.named;
    const auto presets = anatomy::vessel_presets();
    if (std::ranges::find(presets, named, &anatomy::VesselPreset::name) != presets.end()) {
        if (!arguments.images.empty())
            throw BadArgument("--image: expected an exercise, found the preset '" + named +
                              "', which has no C-arm");
        if (!arguments.set.empty())
            throw BadArgument("--set: expected an exercise, found the preset '" + named +
                              "', which has no keys of scenarios");
        return [&](std::uint64_t seed, const anatomy::ModelCache& cache) {
            return bake_preset(arguments, seed, cache);
        };
    }
    const auto exercises = exercise_folders(arguments.vessels.exercises).all();
    // What is neither is told by the presets, which are fewer.
    if (!named.ends_with(".toml") &&
        std::ranges::find(exercises, named, &scenario::ExerciseFiles::name) == exercises.end())
        static_cast<void>(anatomy::vessel_preset(named));
    const std::filesystem::path file = exercise_named(arguments.vessels).file;
    // What is wrong with it is told before all else.
    if (exercise_of(arguments, file, first).motion.moves() && !arguments.images.empty())
        throw BadArgument("--image: expected a patient who lies still, found the moving one of '" + named +
                          "'");
    return [&, file](std::uint64_t seed, const anatomy::ModelCache& cache) {
        return bake_exercise(arguments, file, seed, cache);
    };
}

/// Puts what the exercise, with one of its patients, has in the cache into one file, for the page.
int bake_for_web(const BakeArguments& arguments) {
    if (arguments.without_bodies || !arguments.images.empty() || !arguments.set.empty() ||
        !arguments.cache.empty())
        throw BadArgument(
            "--for-web: expected the exercise as it is, made anew, found --set, --image, --without-bodies or "
            "--cache");
    io::require_writable(arguments.for_web);
    const std::filesystem::path file = exercise_named(arguments.vessels).file;
    const io::ScratchFolder folder;
    anatomy::ModelCache cache;
    cache.folder = folder.path();
    ProgressBar bar;
    report_on(bar, cache);
    const episode::Episode episode(scenario::load_scenario(file, catalogue(), {}, arguments.vessels.patient),
                                   exercise::Pictures::None, cache);
    const anatomy::Anatomy& vessels = episode.simulation().anatomy();
    if (!bake_body(vessels, cache)) throw io::InputError("{}: cannot be written", folder.path().string());
    std::vector<exercise::CarriedFile> files;
    std::size_t bytes = 0;
    for (const anatomy::CacheItem& item : anatomy::cache_items(folder.path())) {
        files.push_back({item.path.filename().string(),
                         io::read_text(item.path, "file", "expected a file of the cache")});
        bytes += files.back().bytes.size();
    }
    std::ranges::sort(files, {}, &exercise::CarriedFile::name);
    const std::string packed = exercise::packed_for_transport(files, vessels);
    io::write_whole(arguments.for_web, packed);
    print("{}: {} files of {:.1f} MB are {:.1f} MB in {}\n", arguments.vessels.named, files.size(),
          1e-6 * static_cast<double>(bytes), 1e-6 * static_cast<double>(packed.size()), arguments.for_web);
    return done;
}

int bake(const BakeArguments& arguments) {
    if (arguments.seeds.empty() == arguments.for_web.empty())
        throw BadArgument("expected either --seeds or --for-web");
    if (!arguments.seeds.empty() && !arguments.vessels.patient.empty())
        throw BadArgument("--patient: expected --for-web, found --seeds, which draw their patients");
    if (!arguments.for_web.empty()) return bake_for_web(arguments);
    const SeedRange seeds = seeds_of(arguments.seeds).value();
    if (arguments.without_bodies && !arguments.images.empty())
        throw BadArgument("--image: expected bodies, found --without-bodies");
    const auto bake_seed = baker_of(arguments, seeds.first);
    anatomy::ModelCache cache;
    cache.folder = usual_cache(arguments.cache);
    if (cache.folder.empty())
        throw BadArgument("expected HOME, XDG_CACHE_HOME or --cache to name a folder, found none");
    std::uint64_t kept = 0, failed = 0, lost = 0;
    {
        ProgressBar bar;
        report_on(bar, cache);
        const auto shows = cache.progress;
        cache.progress = [&shows](double part, const char* what) {
            shows(part, what);
            if (stop_requested()) throw Interrupted();
        };
        for (std::uint64_t seed = seeds.first; seed < seeds.end && !stop_requested(); ++seed) {
            try {
                ++(bake_seed(seed, cache) ? kept : lost);
            } catch (const io::InputError& error) {
                ++failed;
                tell("seed {}: {}\n", seed, error.what());
            } catch (const Interrupted&) {
            }
        }
    }
    print("{}: {} of {} anatomies are in {}{}{}\n", arguments.vessels.named, kept, seeds.end - seeds.first,
          cache.folder.string(), failed > 0 ? fmt::format(", {} cannot be grown", failed) : "",
          lost > 0 ? fmt::format(", {} cannot be kept", lost) : "");
    if (stop_requested()) {
        tell("interrupted: the same command goes on\n");
        return interrupted;
    }
    return failed + lost > 0 ? not_reached : done;
}

}  // namespace

Command add_bake(CLI::App& parser) {
    const auto arguments = std::make_shared<BakeArguments>();
    CLI::App* command = parser.add_subcommand(
        "bake",
        "Make what environments need of the patients of many seeds: vessels, walls, bodies, views\n\n"
        "Examples:\n"
        "  seldinger bake renal --seeds 0:100 --image 128\n"
        "  seldinger bake renal --seeds 0:100 --without-bodies --set tissue.rigid=true\n"
        "  seldinger bake iliac-renal --seeds 0:100\n"
        "  seldinger bake renal --for-web renal.seldweb\n"
        "  seldinger bake renal --for-web renal-2.seldweb --patient 2\n"
        "  seldinger bake aorta --seeds 0:8 --without-bodies");
    command
        ->add_option("vessels", arguments->vessels.named,
                     "Exercise, or vessels as 'anatomy generate --help' lists them; the latter where both "
                     "have the name, and the former by its file")
        ->required()
        ->type_name("EXERCISE|PRESET");
    add_exercises(command, arguments->vessels.exercises);
    add_patient(command, arguments->vessels);
    add_overrides(command, arguments->set);
    command->add_option("--seeds", arguments->seeds, "The last is END - 1")
        ->type_name("FIRST:END")
        ->check(text_that([](const std::string& text) { return seeds_of(text).has_value(); },
                          fmt::format("FIRST:END, as 0:100 for 0 to 99, and up to {} of them", most)));
    add_cache_folder(command, arguments->cache, "the user's own, as of the Python module");
    command
        ->add_option(
            "--image", arguments->images,
            "Keep what an image of so many pixels along a side needs at the start of the exercise, so "
            "that images without contrast from that C-arm need no more; may be repeated")
        ->type_name("PIXELS")
        ->check(CLI::Range(32, 2048));
    command
        ->add_option("--for-web", arguments->for_web,
                     "Instead of --seeds: put what the exercise as it is needs into one file, for browsers")
        ->type_name("FILE");
    command->add_flag("--without-bodies", arguments->without_bodies,
                      "Without the patients around the vessels, which only images and doses need");
    command->footer(
        "What is in the cache already is not made again. The cache holds SELDINGER_CACHE_MB million bytes "
        "(4000);\n"
        "beyond, what was not used for longest is removed.\n"
        "Exit codes: 0 all are there, 1 some cannot be grown or kept, 2 bad input, 130 interrupted.");
    return {command, [arguments] { return bake(*arguments); }};
}

}  // namespace app
