/// `seldinger bake`: grows many anatomies ahead, for environments that draw them.

#include <charconv>
#include <fmt/format.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/exercise/body.h"
#include "engine/io/error.h"

namespace app {
namespace {

struct BakeArguments {
    std::string preset, seeds, cache;
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

int bake(const BakeArguments& arguments) {
    const SeedRange seeds = seeds_of(arguments.seeds).value();
    static_cast<void>(
        anatomy::vessel_preset(arguments.preset));  // that there is none is told before all else
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
                anatomy::VesselTreeSpec spec = anatomy::vessel_preset(arguments.preset, seed);
                spec.name = anatomy::name_of_grown(spec.name, seed);
                const anatomy::Anatomy made = anatomy::generated_anatomy(spec, cache);
                static_cast<void>(anatomy::cached_distance_field(made, 1.0, 0.0, cache));
                bool whole = anatomy::is_kept(spec, cache);
                if (!arguments.without_bodies) {
                    static_cast<void>(exercise::body_around(made, cache));
                    whole = whole && exercise::body_is_kept(made, cache);
                }
                ++(whole ? kept : lost);
            } catch (const io::InputError& error) {
                ++failed;
                tell("seed {}: {}\n", seed, error.what());
            } catch (const Interrupted&) {
            }
        }
    }
    print("{}: {} of {} anatomies are in {}{}{}\n", arguments.preset, kept, seeds.end - seeds.first,
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
        "Grow the anatomies of many seeds into the cache, with their walls and bodies\n\n"
        "Examples:\n"
        "  seldinger bake iliac-renal --seeds 0:100\n"
        "  seldinger bake aorta --seeds 0:8 --without-bodies");
    command->add_option("preset", arguments->preset, "Vessels, as 'anatomy generate --help' lists them")
        ->required()
        ->type_name("PRESET");
    command->add_option("--seeds", arguments->seeds, "The last is END - 1")
        ->required()
        ->type_name("FIRST:END")
        ->check(text_that([](const std::string& text) { return seeds_of(text).has_value(); },
                          fmt::format("FIRST:END, as 0:100 for 0 to 99, and up to {} of them", most)));
    add_cache_folder(command, arguments->cache, "the user's own, as of the Python module");
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
