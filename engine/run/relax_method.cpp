#include "engine/run/relax_method.h"

#include <algorithm>
#include <fmt/format.h>
#include <vector>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace run {
namespace {

using physics::CycleOrder;
using physics::RelaxerConfig;
using physics::RelaxerKind;

constexpr int most_varied = 5, least_delta = 2, most_delta = 200;

[[noreturn]] void refuse(std::string_view method, const std::string& why) {
    throw io::InputError(
        "--method: '{}' {}; methods are: global, first-order, konings, geometric, segment:M (M varied "
        "segments, 1 to {}), segment:M:delta (delta from {} to {} segments), combined:M, combined:M:delta; "
        "after segment:M or segment:M:delta also :no-a, :no-r, :uniform, :plain, :printed, :fast",
        method, why, most_varied, least_delta, most_delta);
}

/// The options that may follow segment:M, in the order in which method_text writes them.
struct Option {
    std::string_view word;
    bool (*is_set)(const RelaxerConfig&);
    void (*set)(RelaxerConfig&);
};
constexpr Option options[] = {
    {"no-a", [](const RelaxerConfig& c) { return !c.bending_curvature; },
     [](RelaxerConfig& c) { c.bending_curvature = false; }},
    {"no-r", [](const RelaxerConfig& c) { return !c.wall_curvature; },
     [](RelaxerConfig& c) { c.wall_curvature = false; }},
    {"uniform", [](const RelaxerConfig& c) { return c.order == CycleOrder::Uniform; },
     [](RelaxerConfig& c) { c.order = CycleOrder::Uniform; }},
    {"plain", [](const RelaxerConfig& c) { return !c.safeguard && !c.printed; },
     [](RelaxerConfig& c) { c.safeguard = false; }},
    {"printed", [](const RelaxerConfig& c) { return c.printed; },
     [](RelaxerConfig& c) { c.printed = true, c.safeguard = false; }},
    {"fast", [](const RelaxerConfig& c) { return c.stored_planes; },
     [](RelaxerConfig& c) { c.stored_planes = true; }},
};

struct MethodWord {
    std::string_view word;
    RelaxerKind kind;
};
constexpr MethodWord alone[] = {{"global", RelaxerKind::Global},
                                {"first-order", RelaxerKind::FirstOrder},
                                {"konings", RelaxerKind::Konings},
                                {"geometric", RelaxerKind::Geometric}};
constexpr MethodWord with_segments[] = {{"segment", RelaxerKind::Segment},
                                        {"combined", RelaxerKind::Combined}};

}  // namespace

const std::string_view method_words =
    "Methods (--method):\n"
    "  global                Newton on all segments at once\n"
    "  segment:M[:delta]     M = 1 to 5 varied segments, their separation fixed (2 to 200) or chosen; then\n"
    "                        :no-a, :no-r   without the curvature of bending, of the wall\n"
    "                        :uniform       whole sweeps in place of the paper's order\n"
    "                        :plain         without the safeguard that it always descends\n"
    "                        :printed       plain, by the paper's 4M x 4M system (Eqs. 27, 33)\n"
    "                        :fast          the wall asked once a sweep, the same equilibrium\n"
    "  first-order           Eq. 22: M = 1 without A and R, plain\n"
    "  konings               M = 1 by small turns, in whole sweeps\n"
    "  geometric             pieces of three segments between joints that stay\n"
    "  combined:M[:delta]    each update of segment:M followed by one of geometric\n"
    "Section 3.3 of the paper: (a) segment:1:plain, (b) first-order, (c) segment:1:no-a:plain,\n"
    "(d) segment:1:no-r:plain, (e) segment:2:plain and segment:3:plain.\n";

RelaxerConfig parse_method(std::string_view method) {
    const std::vector<std::string_view> parts = io::split(method, ':');
    RelaxerConfig config;
    for (const MethodWord& known : alone) {
        if (parts[0] != known.word) continue;
        if (parts.size() > 1) refuse(method, "says more than the method knows");
        config.kind = known.kind;
        return config;
    }
    const MethodWord* known = std::ranges::find(with_segments, parts[0], &MethodWord::word);
    if (known == std::end(with_segments)) refuse(method, "is not known");
    config.kind = known->kind;

    const std::optional<int> m = parts.size() > 1 ? io::parse_integer(parts[1]) : std::nullopt;
    if (!m || *m < 1 || *m > most_varied) refuse(method, "names no possible number of varied segments");
    config.varied_segments = *m;
    std::size_t at = 2;
    if (at < parts.size()) {
        if (const std::optional<int> delta = io::parse_integer(parts[at])) {
            if (*delta < least_delta || *delta > most_delta) refuse(method, "names no possible separation");
            config.separation = delta;
            ++at;
        }
    }
    for (; at < parts.size(); ++at) {
        const Option* option = std::ranges::find(options, parts[at], &Option::word);
        if (config.kind != RelaxerKind::Segment || option == std::end(options))
            refuse(method, fmt::format("has no '{}'", parts[at]));
        if (option->is_set(config)) refuse(method, fmt::format("says '{}' twice", parts[at]));
        option->set(config);
    }
    return config;
}

std::string method_text(const RelaxerConfig& config) {
    for (const MethodWord& known : alone)
        if (config.kind == known.kind) return std::string(known.word);
    const MethodWord* known = std::ranges::find(with_segments, config.kind, &MethodWord::kind);
    std::string text = fmt::format("{}:{}", known->word, config.varied_segments);
    if (config.separation) text += fmt::format(":{}", *config.separation);
    if (config.kind == RelaxerKind::Segment)
        for (const Option& option : options)
            if (option.is_set(config)) text += fmt::format(":{}", option.word);
    return text;
}

}  // namespace run
