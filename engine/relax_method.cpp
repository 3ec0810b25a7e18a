#include "engine/relax_method.h"

#include <fmt/format.h>

#include "engine/error.h"
#include "engine/text.h"

namespace engine {
namespace {

constexpr int kMostSegments = 5, kLeastDelta = 2, kMostDelta = 200;

[[noreturn]] void refuse(std::string_view method, const std::string& why) {
    throw InputError(
        fmt::format("--method: '{}' {}; methods are: global, first-order, segment:M (M varied "
                    "segments, 1 to {}), segment:M:delta (delta from {} to {} segments)",
                    method, why, kMostSegments, kLeastDelta, kMostDelta));
}

}  // namespace

physics::RelaxerConfig parse_method(std::string_view method) {
    physics::RelaxerConfig config;
    if (method == "geometric") refuse(method, "is not in this version");
    if (method == "global") {
        config.kind = physics::RelaxerKind::Global;
        return config;
    }
    if (method == "first-order") {
        config.kind = physics::RelaxerKind::FirstOrder;
        return config;
    }
    constexpr std::string_view prefix = "segment:";
    if (!method.starts_with(prefix)) refuse(method, "is not known");
    config.kind = physics::RelaxerKind::Segment;
    const std::string_view numbers = method.substr(prefix.size());
    const std::size_t colon = numbers.find(':');
    const std::optional<int> m = parse_integer(numbers.substr(0, colon));
    if (!m || *m < 1 || *m > kMostSegments) refuse(method, "names no possible number of varied segments");
    config.varied_segments = *m;
    if (colon != std::string_view::npos) {
        const std::optional<int> delta = parse_integer(numbers.substr(colon + 1));
        if (!delta || *delta < kLeastDelta || *delta > kMostDelta)
            refuse(method, "names no possible separation");
        config.separation = delta;
    }
    return config;
}

std::string method_text(const physics::RelaxerConfig& config) {
    if (config.kind == physics::RelaxerKind::Global) return "global";
    if (config.kind == physics::RelaxerKind::FirstOrder) return "first-order";
    std::string text = fmt::format("segment:{}", config.varied_segments);
    if (config.separation) text += fmt::format(":{}", *config.separation);
    return text;
}

}  // namespace engine
