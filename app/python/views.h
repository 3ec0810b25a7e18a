#pragma once
/// Views of the C-arm as arrays.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/python/free.h"
#include "app/python/values.h"
#include "engine/episode/episode.h"
#include "engine/exercise/branch_stretch.h"
#include "engine/io/error.h"
#include "engine/plan/views.h"
#include "engine/scenario/placement.h"

namespace app {

/// What is asked for; without a branch, the last part of the way to the target.
struct AskedView {
    std::optional<std::string> branch;
    std::optional<double> from, to;  // [mm]
    std::string side, contrast;
    double step, apart;  // [deg]
};

/// The map and the best three views of it.
struct MadeViews {
    plan::ViewTarget target;
    plan::ViewMap map;
    std::vector<plan::BestView> best;
};

inline MadeViews views_of(const scenario::Scenario& scenario, const AskedView& asked,
                          const anatomy::ModelCache& cache) {
    if (asked.branch.has_value() != asked.from.has_value() ||
        asked.branch.has_value() != asked.to.has_value())
        throw io::InputError("expected branch, from_mm and to_mm together, found some of them alone");
    if (!asked.branch && !asked.side.empty())
        throw io::InputError("side: expected a branch with it, found none");
    if (!(asked.apart >= 1 && asked.apart <= 90))
        throw io::InputError("apart_deg: {} was given; expected 1 to 90", asked.apart);
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario, cache);
    const std::string& named = asked.contrast.empty() ? scenario.entry.flush_catheter : asked.contrast;
    const std::optional<int> contrast =
        named.empty() ? std::optional<int>(-1) : anatomy::branch_named(anatomy, named);
    if (!contrast) throw io::InputError("contrast: {}", exercise::unknown_branch(named, anatomy));
    MadeViews made;
    made.target = asked.branch ? plan::view_target(anatomy, *asked.branch, *asked.from, *asked.to, asked.side)
                               : plan::view_target_at(anatomy, scenario::target_of(scenario, anatomy));
    const plan::ViewedTarget target(anatomy, made.target, plan::filled_from(anatomy, *contrast));
    made.map = plan::view_map(target, plan::stand_of(scenario, anatomy, cache), asked.step);
    made.best = plan::best_views(made.map, 3, asked.apart * geometry::degree);
    return made;
}

inline py::dict views(const std::string& file, const std::optional<std::string>& text,
                      const std::string& catalogue,
                      const std::vector<std::pair<std::string, std::string>>& overrides,
                      const std::string& cache_folder, const AskedView& asked) {
    anatomy::ModelCache cache;
    cache.folder = cache_folder;
    cache.progress = [](double, const char*) { look_after_python(); };
    MadeViews made;
    {
        const Free free;
        made = views_of(episode::scenario_of({file, text, catalogue, overrides}), asked, cache);
    }
    const plan::ViewMap& map = made.map;
    const auto rows = static_cast<py::ssize_t>(map.cranial.size()),
               columns = static_cast<py::ssize_t>(map.lao.size());
    const auto in_degrees = [](const std::vector<double>& angles) {
        py::array_t<double> array(static_cast<py::ssize_t>(angles.size()));
        for (std::size_t i = 0; i < angles.size(); ++i)
            array.mutable_at(static_cast<py::ssize_t>(i)) = angles[i] / geometry::degree;
        return array;
    };
    const auto on_grid = [&](const auto& value) {
        using Value = decltype(value(std::size_t{}));
        py::array_t<Value> array({rows, columns});
        for (std::size_t node = 0; node < map.figures.size(); ++node)
            array.mutable_data()[node] = value(node);
        return array;
    };
    py::array_t<double> best({static_cast<py::ssize_t>(made.best.size()), py::ssize_t{2}});
    for (std::size_t k = 0; k < made.best.size(); ++k) {
        best.mutable_at(static_cast<py::ssize_t>(k), 0) = made.best[k].angles.lao / geometry::degree;
        best.mutable_at(static_cast<py::ssize_t>(k), 1) = made.best[k].angles.cranial / geometry::degree;
    }
    py::dict arrays;
    arrays["target"] = made.target.name;
    arrays["lao_deg"] = in_degrees(map.lao);
    arrays["cranial_deg"] = in_degrees(map.cranial);
    arrays["foreshortening"] = on_grid([&](std::size_t node) { return map.figures[node].foreshortening; });
    arrays["overlap"] = on_grid([&](std::size_t node) { return map.figures[node].overlap; });
    arrays["ostium_deg"] =
        on_grid([&](std::size_t node) { return map.figures[node].ostium / geometry::degree; });
    arrays["cost"] = on_grid([&](std::size_t node) { return map.figures[node].cost; });
    arrays["free"] = on_grid([&](std::size_t node) { return map.blocked[node] == plan::Blocked::Free; });
    arrays["best_deg"] = best;
    return arrays;
}

}  // namespace app
