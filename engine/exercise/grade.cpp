#include "engine/exercise/grade.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "engine/io/text.h"
#include "physics/geometry/maths.h"

namespace exercise {
namespace {

using scenario::Benchmark;
using Value = std::optional<double>;

int number_of(const Score& score, HandlingError kind) {
    return counts(score.handling_errors)[static_cast<std::size_t>(kind)];
}

/// To six digits: sums of fractions of a frame have more, which say nothing.
double rounded(double value) {
    return *io::parse_number(fmt::format("{:.6g}", value));
}

/// As many digits as show two that are not 0, and at least the measure's own.
int digits_of(const Measure& measure, double value) {
    if (!(value > 0)) return measure.digits;
    return std::clamp(1 - static_cast<int>(std::floor(geometry::log10(value))), measure.digits, 4);
}

double errors_of(const Score& score) {
    return static_cast<double>(score.handling_errors.size()) - number_of(score, HandlingError::Dissection) -
           number_of(score, HandlingError::Perforation);
}

}  // namespace

std::span<const Measure> measures() {
    static const Measure all[] = {
        {"time", "Time to the target", "s", 1, 25, 1, &Benchmark::completed_after,
         figure_of<&Score::completed_after>, false,
         "Time under the beam and in the vessel is time at risk. Plan the next movement while the last image "
         "is still on the screen, and travel fast only where nothing can be missed.",
         "yes: 89 cardiologists, p = 0.03 (EuroIntervention 2006;2:101); 24 operators (Simul Healthc 2013;8:"
         "324); r = -0.53 with experience (Eur J Vasc Endovasc Surg 2011;42:539). No in 16 operators, renal "
         "(Assessment of a virtual interventional simulator trainer)"},
        {"air_kerma", "Air kerma at the reference point", "mGy", 1, 10, 0.1, &Benchmark::air_kerma,
         figure_of<&Score::air_kerma>, true,
         "It is the dose to the patient's skin. Use fewer pulses a second, take short acquisitions, and take "
         "the foot off the pedal while you think.",
         "not studied itself; fluoroscopy time, which makes most of it: yes, p = 0.005 (EuroIntervention "
         "2006), p < 0.01 (16 operators, renal), 24 operators (Simul Healthc 2013); no in 20 (Eur J Vasc "
         "Endovasc Surg 2011)"},
        {"area_product", "Kerma-area product", "Gy·cm²", 2, 15, 0.02, &Benchmark::area_product,
         figure_of<&Score::area_product>, true,
         "It is what the patient's body and, by scatter, the staff receive. Close the collimator to what you "
         "need to see, and use the widest field that shows it.",
         "not studied itself; see air kerma"},
        {"contrast", "Contrast", "ml", 1, 10, 5, &Benchmark::contrast, figure_of<&Score::contrast>, true,
         "Contrast harms kidneys. Take one good angiogram, make it the roadmap, and let it serve as long as "
         "table and C-arm stay.",
         "yes: 89 cardiologists, p = 0.0008 (EuroIntervention 2006); 24 operators (Simul Healthc 2013). No "
         "in 20 (Eur J Vasc Endovasc Surg 2011)"},
        {"travel", "Travel of the devices", "mm", 0, 10, 10, &Benchmark::wire_travel,
         figure_of<&Score::wire_travel>, false,
         "Every millimetre rubs on a wall. Turn the tip before you push, so that a way is taken once.",
         "not studied itself; smoothness of the tip's way: yes, p < 0.001, 115 tasks (J Vasc Surg, FEVS)"},
        {"wrong_branches", "Entries into wrong branches", "", 0, 10, 1, &Benchmark::wrong_entries,
         figure_of<&Score::wrong_entries>, false,
         "A branch that does not lead to the target can be injured for nothing. Look at the tip against the "
         "roadmap before it enters, and pull back at once where it goes astray.",
         "none found of its own; part of expert-rated lists of errors"},
        {"errors", "Errors of handling", "", 0, 20, 1, &Benchmark::errors,
         [](const Score& s) { return Value(errors_of(s)); }, false,
         "Each is listed with its moment, and what to do instead.",
         "yes: beginners make more (Simul Healthc 2013); most repeatable figure of a trainer, r = 0.9 (J Am "
         "Coll Cardiol 2006;47:1796)"},
    };
    return all;
}

const char* const grade_formula =
    "100 points less what each line costs. A line costs nothing up to the mean of the skilled attempts, and "
    "most · (1 - √((mean + g) / (yours + g))) above it: twice the mean costs about 29 % of what the line can "
    "cost, four times 50 %, eight times 65 %. g is what does not matter: 1 s, 0.1 mGy, 0.02 Gy·cm², 5 ml, 10 "
    "mm, 1 error. Where all skilled attempts took an angiogram, an attempt without one loses dose and "
    "contrast whole, so that looking is never dearer than going blind. Each dissection of a wall costs 15 "
    "points, each perforation 50. Without the target there are no points, and never less than none.";

Grade grade(const Score& score, const Benchmark& benchmark) {
    Grade result;
    result.reached = score.completed;
    const bool blind = score.angiograms == 0 && benchmark.angiograms.least() >= 1;
    result.points = 100;
    for (const Measure& measure : measures()) {
        GradeLine line{&measure, measure.value(score), {}, {}, false, 0};
        if (const scenario::Sample& skilled = benchmark.*measure.sample; skilled.given()) {
            line.mean = skilled.mean();
            line.spread = skilled.spread();
            line.unseen = blind && measure.of_looking;
            if (line.unseen)
                line.cost = measure.most;
            else if (line.yours && *line.yours > *line.mean)
                line.cost = measure.most *
                            (1 - std::sqrt((*line.mean + measure.grain) / (*line.yours + measure.grain)));
        }
        result.points -= line.cost;
        result.lines.push_back(line);
    }
    result.dissections = number_of(score, HandlingError::Dissection);
    result.perforations = number_of(score, HandlingError::Perforation);
    result.points -= result.cost_of_injuries();
    result.points = result.reached ? std::max(0.0, result.points) : 0;
    return result;
}

std::string skilled_text(const GradeLine& line) {
    if (!line.mean) return "-";
    const int digits = std::max(*line.measure->unit ? 0 : 1, digits_of(*line.measure, *line.mean));
    return fmt::format("{:.{}f} ± {:.{}f}{}{}", *line.mean, digits, *line.spread, digits,
                       *line.measure->unit ? " " : "", line.measure->unit);
}

std::string own_text(const GradeLine& line) {
    if (!line.yours) return "-";
    const bool counts = !*line.measure->unit;
    return fmt::format("{:.{}f}{}{}", *line.yours, counts ? 0 : digits_of(*line.measure, *line.yours),
                       counts ? "" : " ", line.measure->unit);
}

Benchmark benchmark_of(std::span<const Score> attempts, std::string by, std::uint64_t scenario) {
    Benchmark made;
    made.by = std::move(by);
    made.attempts = static_cast<int>(attempts.size());
    made.scenario = scenario;
    for (const Measure& measure : measures()) {
        std::vector<double>& values = (made.*measure.sample).values;
        for (const Score& score : attempts)
            if (const Value value = measure.value(score)) values.push_back(rounded(*value));
        if (values.size() != attempts.size()) values.clear();
    }
    for (const Score& score : attempts) made.angiograms.values.push_back(score.angiograms);
    for (const Score& score : attempts)
        if (const Value residual = score.treatment ? score.treatment->worst_residual() : Value())
            made.residual.values.push_back(rounded(std::max(0.0, *residual)));
    if (made.residual.values.size() != attempts.size()) made.residual.values.clear();
    return made;
}

}  // namespace exercise
