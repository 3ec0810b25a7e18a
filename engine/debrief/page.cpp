#include "engine/debrief/page.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <vector>

#include "engine/anatomy/organs.h"
#include "engine/debrief/chart.h"
#include "engine/debrief/page_text.h"
#include "engine/exercise/grade.h"
#include "engine/exercise/score.h"
#include "engine/io/text.h"
#include "physics/geometry/vec.h"

namespace debrief {
namespace {

struct Item {
    int frame = 0;
    const char* kind;  // class of CSS
    std::string text;
};

/// Of the attempt's moment; 0 for one that it does not have.
double seconds_of(const Story& story, int frame) {
    const auto moment = std::ranges::lower_bound(story.moments, frame, {}, &Moment::frame);
    if (moment == story.moments.end() || moment->frame != frame) return 0;
    return moment->seconds;
}

std::vector<Item> items_of(const Story& story) {
    std::vector<Item> items;
    for (const script::Comment& comment : story.comments)
        items.push_back({comment.frame, "said", comment.text});
    for (const exercise::TeacherMark& mark : story.score.teacher)
        items.push_back({mark.frame, "did", exercise::text_of(mark.act)});
    std::ranges::stable_sort(items, {}, &Item::frame);
    return items;
}

using exercise::Score;
using scenario::Benchmark;

/// A row of the table: what is compared, and which way is better.
struct Row {
    const char *name, *unit;
    int digits;
    enum Better { Lower, Higher, Neither } better;
    std::optional<double> (*value)(const Score&);
    const char* meaning;  // HTML
    scenario::Sample scenario::Benchmark::*skilled = nullptr;
};
struct Group {
    const char* name;
    std::vector<Row> rows;
};

using Value = std::optional<double>;

constexpr double least_told = 0.5;  // points; a line that costs less is worth no advice

/// Where no norm is named nobody has published one that could be found.
const std::vector<Group>& groups() {
    static const std::vector<Group> all = {
        {"Time and radiation",
         {{"Time to the target", "s", 1, Row::Lower, exercise::figure_of<&Score::completed_after>,
           "From the start of the attempt to the end of the hold in the target.",
           &Benchmark::completed_after},
          {"of it after the first motion", "s", 1, Row::Lower, exercise::figure_of<&Score::completion_time>,
           "The rest was spent on looking and planning, which is no waste."},
          {"Beam on", "s", 1, Row::Lower, exercise::figure_of<&Score::beam_on_time>,
           "How long the pedal was pressed. What the patient receives also depends on pulses, field and "
           "body: see the two lines below."},
          {"Air kerma at the reference point", "mGy", 2, Row::Lower, exercise::figure_of<&Score::air_kerma>,
           "K<sub>a,r</sub>: the dose to the skin, where the beam stayed in one place.",
           &Benchmark::air_kerma},
          {"Kerma-area product", "Gy·cm²", 2, Row::Lower, exercise::figure_of<&Score::area_product>,
           "P<sub>KA</sub>: what the whole field received. The risk to patient and staff goes with it.",
           &Benchmark::area_product},
          {"Pulses", "", 0, Row::Lower, exercise::figure_of<&Score::pulses>,
           "Images taken. Fewer a second show a slow hand as much."},
          {"DSA runs", "", 0, Row::Neither, exercise::figure_of<&Score::runs>,
           "Times that subtraction was begun. Neither many nor few are good in themselves."},
          {"Cine runs", "", 0, Row::Neither, exercise::figure_of<&Score::cine_runs>,
           "Times that the acquisition pedal was pressed for cine. A second of it costs several of "
           "fluoroscopy."},
          {"Views", "", 0, Row::Neither, exercise::figure_of<&Score::views>,
           "Places of C-arm and table at which the beam was on. Neither many nor few are good in "
           "themselves."},
          {"Angiograms", "", 0, Row::Neither, exercise::figure_of<&Score::angiograms>,
           "Injections that the beam showed. One that serves as a roadmap spares the next.",
           &Benchmark::angiograms},
          {"Contrast", "ml", 1, Row::Lower, exercise::figure_of<&Score::contrast>,
           "All that was injected, seen or not.", &Benchmark::contrast}}},
        {"Hands",
         {{"Travel of the devices", "mm", 0, Row::Lower, exercise::figure_of<&Score::wire_travel>,
           "All advances and withdrawals added up.", &Benchmark::wire_travel},
          {"Back and forth", "%", 0, Row::Lower,
           [](const Score& s) { return Value(100 * s.back_and_forth_ratio); },
           "The part of the travel that led nowhere: 0 is a way taken once, 100 a hand that ends where it "
           "began."},
          {"Reversals", "", 0, Row::Lower, exercise::figure_of<&Score::reversals>,
           "Changes between advancing and withdrawing. To pull back once where the way is lost is right; "
           "many small ones are searching."},
          {"Turned", "deg", 0, Row::Lower,
           [](const Score& s) { return Value(s.rotation / geometry::degree); },
           "All turns of the hubs added up, either way. How much a way needs depends on its branches: "
           "compare attempts at this exercise."},
          {"Idle", "%", 0, Row::Lower, [](const Score& s) { return Value(100 * s.idle_fraction); },
           "The part of the time after the first motion in which no device moved. Thinking with the beam off "
           "costs time alone."}}},
        {"Tip",
         {{"Path efficiency", "%", 0, Row::Higher,
           [](const Score& s) { return Value(100 * s.path_efficiency); },
           "The way along the vessel's centreline, in percent of the way that the tip took. A tip that goes "
           "straight to its target and never back has about 100; one that cuts bends has a little more."},
          {"Mean speed", "mm/s", 1, Row::Higher, exercise::figure_of<&Score::mean_tip_speed>,
           "While it moved. Experts' wires are faster on average than novices' (p &lt; 0.001; 115 tasks on a "
           "simulator, J Vasc Surg, Fundamentals of Endovascular and Vascular Surgery); a number to reach is "
           "not published."},
          {"Smoothness: spectral arc length", "", 2, Row::Higher,
           exercise::figure_of<&Score::spectral_arc_length>,
           "SPARC, always negative. One smooth stroke has about &minus;1.4; every stop and start makes it "
           "lower. Compare attempts at one exercise only: a longer way has more strokes. Experts are "
           "smoother than novices (p &lt; 0.001, the same 115 tasks), and smoothness goes with expert "
           "ratings (20 subjects, IEEE Trans Hum Mach Syst 2016;46:647); a norm for wires is not published."},
          {"Smoothness: log dimensionless jerk", "", 2, Row::Higher,
           exercise::figure_of<&Score::log_dimensionless_jerk>,
           "Negative; the lower the more often the speed changes, and the longer the attempt. It reacts to "
           "the smallest jolts more than the spectral arc length does. There is no norm for wires."},
          {"Entries into wrong branches", "", 0, Row::Lower, exercise::figure_of<&Score::wrong_entries>,
           "Branches that do not lead to the target, each time that the tip went in.",
           &Benchmark::wrong_entries}}},
        {"Wall",
         {{"Largest force of a joint", "N", 2, Row::Lower, exercise::figure_of<&Score::peak_wall_force>,
           "The hardest that one place of the device pressed. A device that leans on a bend spreads its "
           "force; a tip that stands against the wall does not, and injures it first."},
          {"Mean of the largest force", "N", 3, Row::Lower, exercise::figure_of<&Score::mean_wall_force>,
           "Of every moment the hardest place, averaged over the attempt. A stiff device has more, whoever "
           "leads it."},
          {"Time above 1 N", "s", 1, Row::Lower, exercise::figure_of<&Score::time_over_force>,
           "1 N is where an error of handling begins here, not where a wall tears."},
          {"Impulse of all forces", "N s", 1, Row::Lower, exercise::figure_of<&Score::wall_force_impulse>,
           "Forces of all places, added up over time. It grows with time and length inside: compare attempts "
           "at one exercise."},
          {"Errors of handling", "", 0, Row::Lower,
           [](const Score& s) { return Value(static_cast<double>(s.handling_errors.size())); },
           "Each is listed above, with what to do instead. Injuries of the wall are among them."}}}};
    return all;
}

std::string figure(const Value& value, const Row& row) {
    if (!value || !std::isfinite(*value)) return "&ndash;";
    return fmt::format("{:.{}f}{}{}", *value, row.digits, *row.unit ? "&nbsp;" : "", row.unit);
}

/// Whether the value is clearly off what it is compared with, by more than the margin.
const char* judged(const Value& yours, const Value& other, double margin, const Row& row) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const double mine = yours.value_or(none), theirs = other.value_or(none);
    if (!std::isfinite(mine) || !std::isfinite(theirs) || row.better == Row::Neither) return "";
    const double over = mine - theirs, worse = row.better == Row::Lower ? over : -over;
    return worse > margin ? " class=\"worse\"" : worse < -margin ? " class=\"better\"" : "";
}

std::string meanings(bool has_skilled) {
    std::string text = fmt::format(
        "<details><summary>What the figures mean</summary><dl><dt>Marks</dt><dd>{} ! is worse, &#10003; is "
        "better; an attempt that missed its target is better at nothing.</dd>",
        has_skilled
            ? "Held against the skilled attempts where these have the figure, by more than two of their "
              "standard deviations and more than what does not matter (see Grade); else against the "
              "expert's recording, by more than 2 %; else not judged."
            : "No skilled attempts are known for this exercise: held against the expert's recording "
              "where there is one, by more than 2 %, else not judged.");
    for (const Group& group : groups())
        for (const Row& row : group.rows)
            text += fmt::format("<dt>{}</dt><dd>{}</dd>", row.name, row.meaning);
    return text + "</dl></details>";
}

/// What does not matter, as the grade has it.
double grain_of(const Row& row) {
    for (const exercise::Measure& measure : exercise::measures())
        if (measure.sample == row.skilled) return measure.grain;
    return 0;
}

/// Against the skilled attempts, by more than two of their standard deviations, else against the expert's. An
/// attempt before is shown and judges nothing: one that failed has spent less.
std::string table(const Story& story, const Story* before, const Story* expert) {
    const Benchmark& benchmark = story.scenario.lesson.benchmark;
    std::string text = "<table><thead><tr><th></th><th>this attempt</th>";
    if (benchmark.given()) text += "<th>skilled attempts</th>";
    if (expert) text += "<th>expert</th>";
    if (before) text += "<th>attempt before</th>";
    text += "</tr></thead><tbody>";
    const int columns = 2 + benchmark.given() + (expert != nullptr) + (before != nullptr);
    for (const Group& group : groups()) {
        text += fmt::format("<tr class=\"group\"><th colspan=\"{}\">{}</th></tr>", columns, group.name);
        for (const Row& row : group.rows) {
            const Value yours = row.value(story.score);
            Value other = expert ? row.value(expert->score) : Value();
            double margin = other ? 0.02 * std::abs(*other) + 1e-9 : 0;
            std::string skilled = "&ndash;";
            if (row.skilled && (benchmark.*row.skilled).given()) {
                const scenario::Sample& sample = benchmark.*row.skilled;
                other = sample.mean();
                margin = std::max(2 * sample.spread(), grain_of(row) + 1e-9);
                skilled = fmt::format("{} &plusmn; {:.{}f}", figure(other, row), sample.spread(), row.digits);
            }
            std::string_view mark = judged(yours, other, margin, row);
            if (!story.score.completed && mark.find("better") != mark.npos) mark = "";
            text += fmt::format("<tr><td>{}</td><td{}>{}</td>", row.name, mark, figure(yours, row));
            if (benchmark.given()) text += fmt::format("<td>{}</td>", skilled);
            if (expert) text += fmt::format("<td>{}</td>", figure(row.value(expert->score), row));
            if (before) text += fmt::format("<td>{}</td>", figure(row.value(before->score), row));
            text += "</tr>";
        }
    }
    return text + "</tbody></table>";
}

std::string grade_table(const exercise::Grade& grade, const Benchmark& benchmark) {
    std::string text =
        "<table><thead><tr><th></th><th>yours</th><th>skilled</th><th>costs</th></tr></thead><tbody>";
    const auto cost_of = [](double cost, double most) {
        return cost >= 0.05 ? fmt::format("&minus;{:.1f} of {:g}", cost, most) : std::string("0");
    };
    for (const exercise::GradeLine& line : grade.lines) {
        const exercise::Measure& measure = *line.measure;
        text +=
            fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td{}>{}</td></tr>", measure.name,
                        exercise::own_text(line), exercise::skilled_text(line),
                        line.cost >= least_told ? " class=\"costs\"" : "", cost_of(line.cost, measure.most));
    }
    text += fmt::format("<tr><td>Injuries of the wall</td><td>{}</td><td>&ndash;</td><td>{}</td></tr>",
                        grade.dissections + grade.perforations, cost_of(grade.cost_of_injuries(), 100));
    text += "</tbody></table><ul class=\"advice\">";
    if (std::ranges::any_of(grade.lines, [](const auto& line) { return line.unseen; }))
        text += fmt::format("<li>{}</li>", exercise::blind_advice);
    for (const exercise::GradeLine& line : grade.lines)
        if (line.cost >= least_told && !line.unseen)
            text += fmt::format("<li><b>{}.</b> {}</li>", line.measure->name, line.measure->advice);
    text += fmt::format("</ul><p class=\"about\">{} Skilled: {} attempts by {}.</p>",
                        io::html_escaped(exercise::grade_formula), benchmark.attempts,
                        io::html_escaped(benchmark.by));
    text += "<details><summary>Published evidence that these figures separate the experienced</summary><ul>";
    for (const exercise::Measure& measure : exercise::measures())
        text += fmt::format("<li>{}: {}.</li>", measure.name, io::html_escaped(measure.evidence));
    return text + "</ul></details>";
}

std::string errors(const Story& story) {
    const auto& marks = story.score.handling_errors;
    if (marks.empty()) return "<p>None.</p>";
    std::string text = "<ol class=\"errors\">";
    for (std::size_t k = 0; k < marks.size(); ++k) {
        const exercise::HandlingErrorMark& mark = marks[k];
        const auto kind = static_cast<std::size_t>(mark.kind);
        text += fmt::format(
            "<li id=\"row{0}\"><a href=\"#e{0}\"><b>{0}</b>{1}: {2}, from {3:.1f}&nbsp;s (frame {4}), in "
            "{5}</a><small>{6}</small></li>",
            k + 1, exercise::handling_error_texts[kind], exercise::amount_text(mark), mark.start, mark.first,
            io::html_escaped(exercise::place_text(mark)), exercise::handling_error_advice[kind]);
    }
    return text + "</ol>";
}

std::string wrong_branches(const Story& story) {
    std::string text;
    for (const exercise::WrongBranch& branch : story.score.wrong_branches)
        text += fmt::format(
            "<p class=\"note\">The tip went into the {} {} time{}, and was there for {:.1f}&nbsp;s: it does "
            "not lead to the target.</p>",
            io::html_escaped(anatomy::clinical_name(branch.name)), branch.entries,
            branch.entries == 1 ? "" : "s", branch.seconds);
    return text;
}

std::string minutes(double seconds) {
    const int whole = static_cast<int>(seconds);
    return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

/// What happened to the patient and is no error.
std::string set_by_teacher(const Story& story) {
    if (story.score.set_by_teacher.empty()) return "";
    std::string text = "<h3>Set by the teacher</h3><ul class=\"teacher\">";
    for (const exercise::SetByTeacher& event : story.score.set_by_teacher) {
        text += fmt::format("<li>{} at {}", io::html_escaped(event.text), minutes(event.set));
        if (event.relieved && *event.relieved > event.set)
            text += fmt::format(", relieved at {}", minutes(*event.relieved));
        text += event.what.held_off ? ", held off by a device that lay in it</li>" : "</li>";
    }
    return text + "</ul>";
}

/// With what clinicians call the branches that stand in quotes.
std::string in_clinical_names(std::string text, const Story& story) {
    for (const geometry::CentrelineBranch& branch : story.branches) {
        const std::string quoted = "'" + branch.name + "'",
                          named = "'" + anatomy::clinical_name(branch.name) + "'";
        for (std::size_t at = text.find(quoted); at != text.npos; at = text.find(quoted, at + named.size()))
            text.replace(at, quoted.size(), named);
    }
    return text;
}

/// Of the run and of the program, which are no errors of the hand.
std::string notes(const Story& story) {
    if (story.notices.empty()) return "";
    std::string text =
        fmt::format("<details><summary>Notes on the run ({})</summary><ul>", story.notices.size());
    for (const std::string& notice : story.notices)
        text += fmt::format("<li>{}</li>", io::html_escaped(in_clinical_names(notice, story)));
    return text + "</ul></details>";
}

std::string pictures(const Story& story) {
    std::string text = "<div class=\"frames\">";
    for (const KeyFrame& frame : story.key_frames)
        text += fmt::format(
            "<figure data-frame=\"{0}\"><img alt=\"frame {0}\" "
            "src=\"data:image/png;base64,{1}\"><figcaption>Frame {0}: {2}</figcaption></figure>",
            frame.frame, base64(frame.png), io::html_escaped(frame.caption));
    return text + "</div>";
}

std::string treatment_table(std::span<const exercise::TreatmentFigure> rows, bool of_lesion) {
    std::string text = "<table class=\"treatment\">";
    if (of_lesion) text += "<thead><tr><th></th><th>before</th><th>at the end</th><th></th></tr></thead>";
    text += "<tbody>";
    for (const exercise::TreatmentFigure& row : rows)
        text += fmt::format(
            "<tr><td>{}</td>{}<td>{}</td><td class=\"what\">{}</td></tr>", io::html_escaped(row.name),
            of_lesion ? "<td>" + io::html_escaped(row.before) + "</td>" : std::string(),
            io::html_escaped(row.now == "-" ? "\u2013" : row.now), io::html_escaped(row.meaning));
    return text + "</tbody></table>";
}

/// Of balloons and stents. Empty where there was nothing to treat.
std::string treatment_section(const Story& story) {
    if (!story.score.treatment) return "";
    const exercise::TreatmentScore& score = *story.score.treatment;
    std::string text = "\n<h2>Treatment</h2>";
    if (!story.treated.empty()) {
        text += "<div class=\"frames\">";
        for (const KeyFrame& frame : story.treated)
            text += fmt::format(
                "<figure data-frame=\"{0}\"><img alt=\"{2}\" "
                "src=\"data:image/png;base64,{1}\"><figcaption>Frame {0}: {2}</figcaption></figure>",
                frame.frame, base64(frame.png), io::html_escaped(frame.caption));
        text += "</div>";
        if (!story.of_contrast)
            text +=
                "<p class=\"legend\">Not both were taken with contrast in the lesion: these are the last "
                "images before the first inflation and of the attempt.</p>";
    }
    text += treatment_chart(story);
    for (const exercise::LesionScore& lesion : score.lesions)
        text += fmt::format("<h3>Lesion of the {}</h3>", io::html_escaped(exercise::name_of(lesion))) +
                treatment_table(exercise::figures_of(lesion), true);
    if (const scenario::Sample& skilled = story.scenario.lesson.benchmark.residual; skilled.given())
        text += fmt::format(
            "<p>Skilled attempts left a residual stenosis of {:.0f} &plusmn; {:.0f} % in the worst "
            "lesion.</p>",
            skilled.mean(), skilled.spread());
    text += "<h3>Balloon</h3>" + treatment_table(exercise::figures_of(score), false);
    return text + "<p class=\"legend\">The figures are measured, and no grade is made of them.</p>";
}

/// The moments as the script reads them: frame, seconds, x, y, z, inserted, force, way to the target.
std::string data_of(const Story& story) {
    std::string text = "{\"moments\":[";
    for (std::size_t i = 0; i < story.moments.size(); ++i) {
        const Moment& m = story.moments[i];
        text +=
            fmt::format("{}[{},{:.3f},{:.2f},{:.2f},{:.2f},{:.2f},{:.3f},{:.2f}]", i ? "," : "", m.frame,
                        m.seconds, m.tip.x(), m.tip.y(), m.tip.z(), m.inserted.front(), m.force, m.to_target);
    }
    text += "],\"marks\":[";
    for (std::size_t k = 0; k < story.score.handling_errors.size(); ++k)
        text += fmt::format("{}{}", k ? "," : "", story.score.handling_errors[k].first);
    return text + "]}";
}

/// All attempts of all stories, the last of each at its end.
std::vector<const Score*> attempts_of(std::span<const Story> stories) {
    std::vector<const Score*> attempts;
    for (const Story& story : stories) {
        for (const Score& score : story.earlier) attempts.push_back(&score);
        attempts.push_back(&story.score);
    }
    return attempts;
}

std::string curves(std::span<const Story> stories) {
    const std::vector<const Score*> attempts = attempts_of(stories);
    const Benchmark& skilled = stories.back().scenario.lesson.benchmark;
    const auto curve = [&](const char* name, const char* unit, const auto& value,
                           const scenario::Sample& sample = {}) {
        Curve made{name, unit, {}, sample.given() ? Value(sample.mean()) : Value()};
        for (const Score* score : attempts) {
            const Value found = value(*score);
            made.values.push_back(found ? *found : std::numeric_limits<double>::quiet_NaN());
        }
        return learning_curve(made);
    };
    std::string text = "<div class=\"curves\">";
    if (skilled.given())
        text +=
            curve("Points", "", [&](const Score& s) { return Value(exercise::grade(s, skilled).points); });
    text += curve("Time to the target", "s", exercise::figure_of<&Score::completed_after>,
                  skilled.completed_after);
    text += curve("Kerma-area product", "Gy·cm²", exercise::figure_of<&Score::area_product>,
                  skilled.area_product);
    text += curve("Travel", "mm", exercise::figure_of<&Score::wire_travel>, skilled.wire_travel);
    text += curve("Errors of handling", "",
                  [](const Score& s) { return Value(static_cast<double>(s.handling_errors.size())); });
    text += curve("Largest wall force", "N", exercise::figure_of<&Score::peak_wall_force>);
    return text +
           "</div><p class=\"legend\">Attempts in the order in which they were recorded; a cross is one "
           "that did not reach the target.</p>";
}

/// A heading and a list, of the last attempt; comments on those before it follow with their frames. Empty
/// where no teacher was. An item with "data-frame" moves the time line to its moment.
std::string teacher_section(const Story& story) {
    const std::vector<Item> items = items_of(story);
    if (items.empty() && story.comments_before.empty()) return "";
    std::string text = "\n<h2>The teacher</h2><ul class=\"teacher\">";
    for (const script::Comment& comment : story.comments_before)
        text += fmt::format(
            "<li class=\"said\"><b>before</b>{} <small>frame {}, of an attempt before this one"
            "</small></li>",
            io::html_escaped(comment.text), comment.frame);
    for (const Item& item : items)
        text +=
            fmt::format("<li class=\"{}\" data-frame=\"{}\"><b>{}</b>{}</li>", item.kind, item.frame,
                        exercise::moment_text(seconds_of(story, item.frame)), io::html_escaped(item.text));
    return text +
           "</ul><p class=\"legend\">Nothing of this changes the figures; what was shown or hidden may "
           "have helped or hindered.</p>";
}

}  // namespace

std::string base64(std::span<const std::uint8_t> bytes) {
    constexpr const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? bytes[i + k] : 0);
        for (std::size_t k = 0; k < 4; ++k) text += k <= left ? letters[word >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::string page(std::span<const Story> stories, const Story* expert) {
    const Story& story = stories.back();
    const Story* before = stories.size() > 1 ? &stories[stories.size() - 2] : nullptr;
    const Benchmark& benchmark = story.scenario.lesson.benchmark;
    const std::string title = io::html_escaped(story.scenario.title);
    std::string text = fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<meta name=\"viewport\" content=\"width=device-width\">"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
        "'unsafe-inline'; script-src 'unsafe-inline'\">"
        "<title>Debriefing: {}</title><style>{}</style></head><body>\n",
        title, page_style);
    text += fmt::format(
        "<header><h1>{}</h1><p class=\"about\">Debriefing{}. Recording {}, scenario {}{}, {}.</p>", title,
        story.origin.learner.empty() ? "" : " of " + io::html_escaped(story.origin.learner),
        io::html_escaped(std::filesystem::path(story.file).filename().string()),
        io::html_escaped(story.scenario.name),
        story.scenario.patient.empty()
            ? ""
            : io::html_escaped(", " + story.scenario.patient_text() +
                               (benchmark.given() ? " (skilled attempts are of the first patient)" : "")),
        story.origin.program.empty() ? "program unknown" : io::html_escaped(story.origin.program));
    text += "<div class=\"verdict\">";
    const exercise::Grade grade = exercise::grade(story.score, benchmark);
    if (benchmark.given())
        text += fmt::format("<div class=\"points\">{:.0f}<small> of 100 points</small></div>", grade.points);
    text += story.score.completed_after
                ? fmt::format("<div class=\"reached\">Target reached after {:.1f} s</div>",
                              *story.score.completed_after)
                : "<div class=\"missed\">Target not reached</div>";
    text += fmt::format(
        "<div>{} error{} of handling, {:.1f} s of beam, {:.0f} ml of contrast</div></div></header>",
        story.score.handling_errors.size(), story.score.handling_errors.size() == 1 ? "" : "s",
        story.score.beam_on_time, story.score.contrast);
    if (!story.differences.empty())
        text += fmt::format(
            "<p class=\"note\">This recording does not lead to the states it states; it was edited, or "
            "made by another program: {}</p>",
            io::html_escaped(story.differences.front()));

    if (benchmark.given()) text += "<h2>Grade</h2>" + grade_table(grade, benchmark);
    text += "\n<h2>Time line</h2><p class=\"legend\">";
    for (std::size_t k = 0; k < story.scenario.devices.size(); ++k)
        text += fmt::format("<i style=\"background:{}\"></i>{}", ink::devices[k],
                            story.scenario.devices[k].name());
    text +=
        "<i style=\"background:#e69f00\"></i>beam<i style=\"background:#8a5a00\"></i>DSA"
        "<i style=\"background:#cc79a7\"></i>injection<i style=\"background:#b4003c\"></i>error";
    if (!story.comments.empty())
        text += fmt::format("<i style=\"background:{}\"></i>the teacher's comment", ink::comment);
    text +=
        "; dashed: 1 N, and the target's radius. <span class=\"screen\">Click, or use the arrow keys, to "
        "look at a moment.</span></p>";
    text += time_line(story) + "<p id=\"moment\"></p>";
    text += "\n<div class=\"two\"><section><h2>Way of the tip</h2>" + tip_over_vessels(story) + "</section>";
    text += "\n<section><h2>Errors of handling</h2>" + errors(story) + wrong_branches(story) +
            set_by_teacher(story) + "</section></div>";
    text += treatment_section(story);
    text += teacher_section(story);
    if (!story.key_frames.empty()) text += "\n<h2>What the screen showed</h2>" + pictures(story);
    text += "\n<h2>Figures</h2>" + table(story, before, expert) + meanings(benchmark.given());
    if (attempts_of(stories).size() > 1) text += "\n<h2>Learning curve</h2>" + curves(stories);
    text += notes(story);
    text += fmt::format(
        "\n<script type=\"application/json\" id=\"data\">{}</script><script>{}</script></body></html>\n",
        data_of(story), page_script);
    return io::as_utf8(text);
}

}  // namespace debrief
