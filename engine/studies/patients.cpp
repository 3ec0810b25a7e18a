#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/grow/vessel_tree.h"
#include "engine/io/error.h"
#include "engine/studies/claims.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/geometry/vec.h"

namespace studies {
namespace {

using anatomy::Patient;
using anatomy::SampledBranch;
using anatomy::Sex;
using anatomy::VesselTree;

/// A published dimension of vessels, and how it is measured in a grown tree.
struct PublishedFigure {
    std::string_view preset, quantity;  // the latter with its unit
    double mean, deviation;
    std::optional<anatomy::Sex> sex;  // published for one sex alone
    std::string_view source;          // "estimate" where nothing is published
    std::function<double(const VesselTree&)> measured;
};

constexpr std::optional<anatomy::Sex> both;

/// The branch that has this vessel as one of its parts.
const SampledBranch& with_part(const VesselTree& tree, const std::string& part) {
    for (const SampledBranch& branch : tree.branches)
        if (("+" + branch.name + "+").find("+" + part + "+") != std::string::npos) return branch;
    throw std::logic_error("no branch has the part " + part);
}
double at(const SampledBranch& branch, double arc) {
    return 2 * branch.radii[branch.sample_at(arc)];
}
/// A branch's diameter at its start, its end, or its middle.
auto start(const char* part) {
    return [part](const VesselTree& tree) { return 2 * with_part(tree, part).radii.front(); };
}
auto end(const char* part) {
    return [part](const VesselTree& tree) { return 2 * with_part(tree, part).radii.back(); };
}
auto middle(const char* part) {
    return [part](const VesselTree& tree) {
        const SampledBranch& branch = with_part(tree, part);
        return 2 * branch.radii[branch.radii.size() / 2];
    };
}
/// Where a branch leaves its parent [mm].
double origin(const VesselTree& tree, const std::string& part) {
    const SampledBranch& branch = with_part(tree, part);
    return branch.parent_sample * tree.branches[branch.parent].step();
}
double length_between(const VesselTree& tree, const std::string& from, const std::string& to) {
    return origin(tree, to) - origin(tree, from);
}
/// Angle between a branch and the way on of its parent, as far as `reach` outside [deg, mm].
double take_off(const VesselTree& tree, const std::string& part, double reach) {
    const SampledBranch& branch = with_part(tree, part);
    const SampledBranch& parent = tree.branches[branch.parent];
    const int last = static_cast<int>(branch.points.size()) - 1;
    const int to = std::min(last, branch.exit + static_cast<int>(std::lround(reach / branch.step())));
    const Vec3 away = (branch.points[to] - branch.points[0]).normalized();
    const double cosine = away.dot(parent.tangent(branch.parent_sample));
    return std::acos(std::clamp(cosine, -1.0, 1.0)) / geometry::degree;
}
/// Between the feet of the arch, where the descending aorta is as low as the ascending one's middle [mm].
double arch_width(const VesselTree& tree) {
    const SampledBranch& aorta = tree.branches[0];
    double width = 0;
    for (const Vec3& p : aorta.points) {
        Vec3 across = p - aorta.points[0];
        across.z() = 0;
        if (p.z() > aorta.points[0].z()) width = std::max(width, across.norm());
    }
    return width;
}

const PublishedFigure figure_list[] = {
    {"arch-1", "ascending aorta [mm]", 34.6, 4.7, both, "Yan, CT of 217",
     [](const VesselTree& t) { return at(t.branches[0], 40); }},
    {"arch-1", "brachiocephalic trunk [mm]", 12.5, 2.0, both, "Yan", start("brachiocephalic")},
    {"arch-1", "left common carotid [mm]", 8.3, 1.5, both, "Yan", start("LCCA")},
    {"arch-1", "left subclavian [mm]", 10.4, 2.2, both, "Yan", start("LSA")},
    {"arch-1", "internal carotid [mm]", 4.7, 0.7, both, "Baz 2021; spread estimated", end("LICA")},
    {"arch-1", "arch's plane from sagittal [deg]", 50, 14, both, "Yan",
     [](const VesselTree& t) {
         const SampledBranch& aorta = t.branches[0];
         const auto higher = [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); };
         const auto top = std::max_element(aorta.points.begin(), aorta.points.end(), higher);
         const auto i = static_cast<int>(top - aorta.points.begin());
         const Vec3 along = aorta.tangent(i);
         return std::atan2(along.x(), along.y()) / geometry::degree;
     }},
    {"arch-1", "arch's width [mm]", 80, 8, both, "estimate", arch_width},
    {"arch-arms", "axillary artery [mm]", 6.0, 1.1, both, "Arnett 2018, CT of 208",
     [](const VesselTree& t) { return at(with_part(t, "Raxillary"), origin(t, "RVA") + 116); }},
    {"arch-arms", "radial artery of men [mm]", 2.68, 0.4, Sex::Male, "Wahood 2022; spread Yoo 2005",
     end("Rradial")},
    {"arch-arms", "radial artery of women [mm]", 2.27, 0.34, Sex::Female, "Wahood 2022; spread Yoo 2005",
     end("Rradial")},
    {"lca", "left main of men [mm]", 4.5, 0.5, Sex::Male, "Dodge 1992", start("LM")},
    {"lca", "left main of women [mm]", 4.1, 0.45, Sex::Female, "Dodge 1992: −9 %", start("LM")},
    {"lca", "distal LAD of men [mm]", 1.9, 0.4, Sex::Male, "Dodge 1992", end("LAD")},
    {"lca", "circumflex of men [mm]", 3.4, 0.5, Sex::Male, "Dodge 1992", start("LCX")},
    {"lca", "LAD and circumflex [deg]", 63, 19, both, "Moon 2018, CT of 201; spread Heart Res Open J 2016",
     [](const VesselTree& t) { return take_off(t, "LCX", 8); }},
    {"rca", "right coronary of men [mm]", 3.9, 0.6, Sex::Male, "Dodge 1992", start("RCA")},
    {"iliac-renal", "infrarenal aorta of men [mm]", 16.5, 1.6, Sex::Male, "16.5 and 14.5; spread Kim 2022",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "RCIA") - 4); }},
    {"iliac-renal", "infrarenal aorta of women [mm]", 14.4, 1.5, Sex::Female,
     "16.5 and 14.5; spread Kim 2022",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "RCIA") - 4); }},
    {"iliac-renal", "common iliac of men [mm]", 9.7, 1.4, Sex::Male, "9.7 and 8.5; spread Kim 2022",
     [](const VesselTree& t) { return at(with_part(t, "RCIA"), origin(t, "RIIA") - 40); }},
    {"iliac-renal", "common femoral of men [mm]", 8.5, 1.1, Sex::Male, "Sandgren 1999; spread estimated",
     end("LCFA")},
    {"iliac-renal", "common femoral of women [mm]", 7.9, 1.0, Sex::Female, "Sandgren 1999; spread estimated",
     end("LCFA")},
    {"iliac-renal", "left renal [mm]", 5.6, 0.7, both, "CT of 202; spread estimated", start("LRA")},
    {"iliac-renal", "superior mesenteric [mm]", 5.9, 0.9, both, "5.9; spread estimated", start("SMA")},
    {"iliac-renal", "coeliac trunk [mm]", 5.9, 0.9, both, "5.9; spread estimated", start("coeliac")},
    {"iliac-renal", "inferior mesenteric [mm]", 3.1, 0.47, both, "3.1; spread estimated", start("IMA")},
    {"iliac-renal", "coeliac to superior mesenteric [mm]", 15.7, 2.9, both, "PMID 23262554; spread estimated",
     [](const VesselTree& t) { return length_between(t, "coeliac", "SMA"); }},
    {"iliac-renal", "angle of the superior mesenteric [deg]", 50, 16, both, "Jang 2002",
     [](const VesselTree& t) { return take_off(t, "SMA", 4); }},
    {"femoral", "superficial femoral of men [mm]", 6.3, 0.75, Sex::Male, "6.3 and 6.0; spread estimated",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "LPFA") + 60); }},
    {"cerebral", "cavernous carotid [mm]", 5.0, 0.6, both, "Rai 2013", start("ICA")},
    {"cerebral", "M1 [mm]", 3.1, 0.4, both, "Rai 2013",
     [](const VesselTree& t) { return at(t.branches[0], 0.5 * (origin(t, "A1") + origin(t, "M2inf"))); }},
    {"cerebral", "M2 [mm]", 2.4, 0.4, both, "Rai 2013",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "M2inf") + 6.6); }},
    {"circle", "A1 [mm]", 2.09, 0.27, both, "Shatri 2017, MRA",
     [](const VesselTree& t) { return at(with_part(t, "LA1"), 8); }},
    {"circle", "anterior communicating [mm]", 1.5, 0.22, both, "Shatri 2017", middle("ACOM")},
    {"circle", "posterior communicating [mm]", 1.22, 0.2, both, "Shatri 2017", middle("LPCOM")},
    {"circle", "P1 [mm]", 2.1, 0.35, both, "Shatri 2017, Rai 2013",
     [](const VesselTree& t) { return at(with_part(t, "RP1"), 6); }},
    {"circle", "basilar [mm]", 3.3, 0.5, both, "Rai 2013, Shatri 2017",
     [](const VesselTree& t) { return at(with_part(t, "BA"), origin(t, "LSCA") - 12); }},
    {"circle", "vertebral [mm]", 3.9, 0.8, both, "Rai 2013", start("LVA")},
    {"circle", "length of posterior communicating [mm]", 12.9, 0.9, both, "Shatri 2017",
     [](const VesselTree& t) {
         const SampledBranch& b = with_part(t, "LPCOM");
         return (b.entry - b.exit) * b.step();
     }},
};

double mean_of(const std::vector<double>& x) {
    double sum = 0;
    for (const double value : x) sum += value;
    return sum / static_cast<double>(x.size());
}
double deviation_of(const std::vector<double>& x) {
    const double mean = mean_of(x);
    double sum = 0;
    for (const double value : x) sum += (value - mean) * (value - mean);
    return std::sqrt(sum / static_cast<double>(x.size() - 1));
}
double correlation(const std::vector<double>& x, const std::vector<double>& y) {
    const double mean_x = mean_of(x), mean_y = mean_of(y);
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - mean_x) * (y[i] - mean_y);
    return sum / static_cast<double>(x.size() - 1) / (deviation_of(x) * deviation_of(y));
}
/// Between each number and the one after it.
double lag_one(const std::vector<double>& x) {
    return correlation({x.begin(), x.end() - 1}, {x.begin() + 1, x.end()});
}

/// What a hundred seeds of one preset gave.
struct Drawn {
    std::vector<int> seeds;  // that gave vessels; patients and trees correspond to them
    std::vector<Patient> patients;
    std::vector<anatomy::VesselTree> trees;
    int rejected = 0, most_rejected = 0, seeds_rejected = 0;
    std::string failed;  // of the first seed without any vessels
};

Drawn draw(std::string_view preset, int seeds) {
    Drawn drawn;
    for (int seed = 1; seed <= seeds; ++seed) {
        try {
            anatomy::DrawnVessels one = anatomy::draw_vessels(preset, static_cast<std::uint64_t>(seed));
            drawn.trees.push_back(anatomy::grow(one.spec));
            drawn.patients.push_back(*one.spec.patient);
            drawn.seeds.push_back(seed);
            drawn.rejected += one.rejected;
            drawn.most_rejected = std::max(drawn.most_rejected, one.rejected);
            drawn.seeds_rejected += one.rejected > 0;
        } catch (const io::InputError& error) {
            if (drawn.failed.empty()) drawn.failed = fmt::format("seed {}: {}", seed, error.what());
        }
    }
    return drawn;
}

std::string spread_text(double mean, double deviation) {
    return fmt::format("{:.3g} ± {:.2g}", mean, deviation);
}

/// Compares one published dimension with the drawn ones.
struct Comparison {
    double mean, deviation, consecutive, with_age, with_height;
    int count;
};
Comparison compare(const PublishedFigure& figure, const Drawn& drawn) {
    std::vector<double> all, chosen, ages, heights;
    for (std::size_t i = 0; i < drawn.trees.size(); ++i) {
        all.push_back(figure.measured(drawn.trees[i]));
        if (figure.sex && drawn.patients[i].sex != figure.sex) continue;
        chosen.push_back(all.back());
        ages.push_back(drawn.patients[i].age);
        heights.push_back(drawn.patients[i].height);
    }
    return {mean_of(chosen),           deviation_of(chosen),         lag_one(all),
            correlation(chosen, ages), correlation(chosen, heights), static_cast<int>(chosen.size())};
}

void add_surface(io::Table& table, std::string_view preset, int seed, std::vector<std::string>& failed) {
    try {
        const anatomy::Anatomy anatomy =
            anatomy::generate(anatomy::vessel_preset(preset, static_cast<std::uint64_t>(seed)));
        const double angle = anatomy::smallest_angles(anatomy.lumen).percentile / geometry::degree;
        const int crossings = anatomy::self_intersections(anatomy.lumen);
        table.add({preset, seed, anatomy.lumen.triangles.size(), anatomy.ends.size(), angle, crossings});
        if (crossings > 0) failed.push_back(fmt::format("{} {}: triangles cross", preset, seed));
    } catch (const io::InputError& error) {
        failed.push_back(fmt::format("{} {}: {}", preset, seed, error.what()));
    }
}

/// A dimension of two patients who differ in one thing, with seed 0.
double change(std::string_view preset, const anatomy::PatientWish& from, const anatomy::PatientWish& to,
              const std::function<double(const VesselTree&)>& measured) {
    return measured(anatomy::grow(anatomy::vessel_preset(preset, 0, to))) -
           measured(anatomy::grow(anatomy::vessel_preset(preset, 0, from)));
}
const PublishedFigure& figure_of(std::string_view quantity) {
    return *std::ranges::find(figure_list, quantity, &PublishedFigure::quantity);
}

void add_effects(StudyResult& result) {
    const auto add = [&](const std::string& text, double published, double measured, double tolerance) {
        result.claim(text, published, measured, std::abs(measured - published) <= tolerance,
                     "two patients of seed 0 that differ in nothing else");
    };
    anatomy::PatientWish young, old, woman, man, small, tall;
    young.age = 55, old.age = 65;
    woman.sex = Sex::Female, man.sex = Sex::Male;
    small.height = 1600, tall.height = 1800;
    const PublishedFigure &ascending = figure_of("ascending aorta [mm]"),
                          &femoral = figure_of("common femoral of men [mm]"),
                          &left_main = figure_of("left main of men [mm]"),
                          &width = figure_of("arch's width [mm]");
    add("MESA (Turkbey 2014): the ascending aorta widens in ten years by [mm]", 1.0,
        change("arch-1", young, old, ascending.measured), 0.2);
    add("MESA: the ascending aorta of men is wider by [mm]", 1.9,
        change("arch-1", woman, man, ascending.measured), 0.3);
    add("Dodge 1992: a woman's left main coronary artery over a man's", 0.91,
        1 + change("lca", man, woman, left_main.measured) / left_main.mean, 0.01);
    add("Sandgren 1999: a man's common femoral artery is wider by [mm]", 0.6,
        change("iliac-renal", woman, man, femoral.measured), 0.1);
    const double wider = change("arch-1", young, old, width.measured);
    result.claim("Redheuil 2011: the arch widens with age", "yes",
                 fmt::format("{:.1f} mm in ten years", wider), wider > 0,
                 "two patients of seed 0 that differ in nothing else");
}

}  // namespace

StudyResult run_patients(const StudyOptions& options) {
    const int seeds = options.quick ? 40 : 100, surfaces = options.quick ? 0 : 2;
    const auto presets = anatomy::vessel_presets();
    const int of = static_cast<int>(presets.size()) * (1 + surfaces);
    Work work(options, of);
    io::Table validity{
        "validity", {"preset", "seeds", "grown", "draws_rejected", "most_for_a_seed", "seeds_with_rejected"}};
    io::Table dimensions{"dimensions",
                         {"preset", "quantity", "source", "published_mean", "published_deviation", "mean",
                          "deviation", "patients", "consecutive_seeds", "with_age", "with_height"}};
    io::Table people{"patients",
                     {"seed", "sex", "age_years", "height_cm", "weight_kg", "ascending_aorta_mm"}};
    io::Table meshes{"surfaces", {"preset", "seed", "triangles", "ends", "p1_angle_deg", "crossings"}};
    StudyResult result;
    std::vector<double> shifts;
    int grown = 0, wanted = 0, rejected = 0;
    std::string failure;
    std::vector<std::string> broken;
    for (const anatomy::VesselPreset& preset : presets) {
        const Drawn drawn = draw(preset.name, seeds);
        wanted += seeds, grown += static_cast<int>(drawn.trees.size()), rejected += drawn.rejected;
        if (failure.empty() && !drawn.failed.empty())
            failure = fmt::format("{} {}", preset.name, drawn.failed);
        validity.add({preset.name, seeds, drawn.trees.size(), drawn.rejected, drawn.most_rejected,
                      drawn.seeds_rejected});
        for (const PublishedFigure& figure : figure_list) {
            if (figure.preset != preset.name || drawn.trees.size() < 10) continue;
            const Comparison c = compare(figure, drawn);
            dimensions.add({preset.name, figure.quantity, figure.source, figure.mean, figure.deviation,
                            c.mean, c.deviation, c.count, c.consecutive, c.with_age, c.with_height});
            shifts.push_back(c.consecutive);
            if (figure.source == "estimate") continue;
            // Three standard errors, and the width of what is measured at one place and published for a
            // stretch.
            const double error = 3 * figure.deviation / std::sqrt(c.count) + 0.02 * figure.mean;
            const bool holds = std::abs(c.mean - figure.mean) <= error &&
                               c.deviation >= 0.7 * figure.deviation &&
                               c.deviation <= 1.35 * figure.deviation;
            result.claim(fmt::format("{}: {} ({})", preset.name, figure.quantity, figure.source),
                         spread_text(figure.mean, figure.deviation), spread_text(c.mean, c.deviation), holds,
                         fmt::format("{} patients; mean within three standard errors and 2 %, spread within "
                                     "0.7 to 1.35 of the published",
                                     c.count));
        }
        if (preset.name == "arch-1") {
            for (std::size_t i = 0; i < drawn.trees.size(); ++i) {
                const Patient& p = drawn.patients[i];
                people.add({drawn.seeds[i], p.sex == Sex::Female ? "f" : "m", p.age, p.height / 10, p.weight,
                            figure_of("ascending aorta [mm]").measured(drawn.trees[i])});
            }
        }
        work.tell(fmt::format("{}, {} patients", preset.name, seeds));
        for (int seed = 1; seed <= surfaces; ++seed) {
            add_surface(meshes, preset.name, seed, broken);
            work.tell(fmt::format("{}, surface of seed {}", preset.name, seed));
        }
    }
    double square = 0, largest = 0;
    for (const double r : shifts) square += r * r, largest = std::max(largest, std::abs(r));
    const double usual = std::sqrt(square / static_cast<double>(shifts.size()));
    const double chance = 1 / std::sqrt(seeds - 1.0);
    result.claim("correlation between consecutive seeds, root mean square of all dimensions", chance, usual,
                 usual < 1.3 * chance, "what independent numbers have by chance");
    result.claim("largest correlation between consecutive seeds", 0.0, largest, largest < 4 * chance,
                 "four times what one has by chance is accepted: there are dozens");
    result.claim("patients whose vessels can be grown", wanted, grown, grown == wanted, failure);
    result.claim(
        "draws rejected, because vessels ran into each other or bent too tightly, of all [%]", 0.0,
        100.0 * rejected / (rejected + grown), rejected < 0.25 * (rejected + grown),
        "expected at most a quarter: dimensions are kept and only angles and bends drawn again, six times");
    if (surfaces > 0)
        result.claim("surfaces that could not be generated, or cross themselves", 0.0, broken.size(),
                     broken.empty(), broken.empty() ? "" : broken.front());
    add_effects(result);
    result.plots = {filled_plot("patients", 1250, 900, {})};
    const std::string of_surfaces =
        surfaces > 0 ? "\nThe surfaces of two of each:\n\n" + io::to_markdown(meshes) : "";
    result.page = filled_page("patients",
                              {{"seeds", seeds},
                               {"validity", io::to_markdown(validity)},
                               {"dimensions", io::to_markdown(dimensions, 3)},
                               {"surfaces", of_surfaces}},
                              result, options);
    result.tables = {std::move(validity), std::move(dimensions), std::move(people), std::move(meshes)};
    return result;
}

}  // namespace studies
