#include "engine/debrief/course_page.h"

#include <algorithm>
#include <fmt/format.h>
#include <map>

#include "engine/debrief/chart.h"
#include "engine/debrief/course_learner.h"
#include "engine/debrief/page_text.h"
#include "engine/exercise/grade.h"
#include "engine/io/text.h"

namespace debrief {
namespace {

using io::html_escaped;

constexpr const char* none = "&ndash;";

// clang-format off
const char* const course_style = R"style(
.wide{overflow-x:auto}
small{color:var(--soft);display:block;font-weight:400}
.matrix td:not(:first-child),.matrix thead th:not(:first-child){text-align:center;white-space:nowrap}
.many thead th span{writing-mode:vertical-rl;transform:rotate(180deg)}
.many{font-size:13px}
.many td:first-child{min-width:200px}
.many td:not(:first-child),.many th:not(:first-child){padding:4px 3px}
.many td:not(:first-child) small{display:none}
td.passed{background:#e2f1ec;color:var(--good);font-weight:600}
td.late{background:#fff0cc;font-weight:600}
td.text,th.text{text-align:left}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(330px,1fr));gap:12px}
.card{border:1px solid var(--rule);border-radius:6px;padding:10px 14px}
.card h3,.learner h3{font-size:16px;margin:0 0 4px}
.card ul{margin:4px 0 0;padding-left:18px}
.card p{margin:2px 0}
.learner{margin:0 0 22px}
.learner svg{width:150px;height:34px;display:inline-block;vertical-align:middle}
details table,h3+.wide table,h4+.wide table{font-size:12px}
details th,details td,h3+.wide th,h3+.wide td,h4+.wide th,h4+.wide td{padding:3px 6px}
h4{font-size:13px;margin:10px 0 0}
.day,.state{white-space:nowrap}
.what{min-width:150px}
a{color:var(--accent)}
@media print{.card,.learner{break-inside:avoid}details{display:none}a{color:inherit;text-decoration:none}}
)style";
// clang-format on

std::string counted(std::size_t count, const char* what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string number(const std::optional<double>& value, int digits) {
    return value ? fmt::format("{:.{}f}", *value, digits) : std::string(none);
}

/// Three digits: doses of a tube and of a patient differ by a thousand times.
std::string dose(const std::optional<double>& value) {
    return value ? fmt::format("{:.3g}", *value) : std::string(none);
}

std::string name_of(const LearnerCourse& learner) {
    return learner.name.empty() ? "(no name)" : html_escaped(learner.name);
}
std::string name_of(const PlannedExercise& exercise) {
    return html_escaped(exercise.title.empty() ? exercise.name : exercise.title);
}

/// Everything that the page is made of.
struct Course {
    const CoursePlan& plan;
    std::vector<LearnerCourse> learners;
    Day today;

    std::size_t place(const LearnerCourse& learner) const {
        return static_cast<std::size_t>(&learner - learners.data()) + 1;
    }
    /// What the plan lists, or what somebody has tried.
    bool shows(std::size_t exercise) const {
        return plan.lists_exercises || std::ranges::any_of(learners, [&](const auto& learner) {
                   return !learner.exercises[exercise].attempts.empty();
               });
    }
};

/// Points of attempts in order, with a line at what passes; a ring is one that did not reach the target.
std::string curve(const Standing& standing) {
    constexpr double width = 150, height = 34, edge = 5;
    const auto across = [&](std::size_t k) {
        const std::size_t last = standing.attempts.size() - 1;
        return last == 0 ? width / 2
                         : edge + (width - 2 * edge) * static_cast<double>(k) / static_cast<double>(last);
    };
    const auto down = [&](double points) { return height - edge - (height - 2 * edge) * points / 100; };
    std::string line, dots, words;
    for (std::size_t k = 0; k < standing.attempts.size(); ++k) {
        const CourseRow& row = *standing.attempts[k];
        if (!row.points) continue;
        const double x = across(k), y = down(*row.points);
        line += fmt::format("{:.1f},{:.1f} ", x, y);
        dots += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\" fill=\"{}\" stroke=\"{}\"/>", x, y,
                            row.reached ? ink::wire : "#fff", ink::wire);
        words += fmt::format("{}{:.0f}", words.empty() ? "" : ", ", *row.points);
    }
    if (words.empty()) return none;
    return fmt::format(
        "<svg viewBox=\"0 0 {0} {1}\" role=\"img\" aria-label=\"points: {2}\"><title>Points: {2}; {3:g} "
        "pass</title><line x1=\"0\" x2=\"{0}\" y1=\"{4:.1f}\" y2=\"{4:.1f}\" stroke=\"#5b636d\" "
        "stroke-dasharray=\"4 3\"/><polyline points=\"{5}\" fill=\"none\" stroke=\"{6}\" "
        "stroke-width=\"1.5\"/>{7}</svg>",
        width, height, words, standing.exercise->pass, down(standing.exercise->pass), line, ink::wire, dots);
}

std::string matrix_cell(const Standing& standing, Day today) {
    const std::string attempts =
        standing.attempts.empty() ? "not tried" : counted(standing.attempts.size(), "attempt");
    if (standing.passed)
        return fmt::format("<td class=\"passed\">&#10003; {}<small>{}</small></td>",
                           standing.best ? number(standing.best, 0) : "reached", attempts);
    const bool late = standing.overdue(today);
    if (!late && standing.attempts.empty()) return fmt::format("<td>{}</td>", none);
    return fmt::format("<td{}>{}{}<small>{}{}</small></td>", late ? " class=\"late\"" : "", late ? "! " : "",
                       number(standing.best, 0), attempts, late ? ", overdue" : "");
}

std::string matrix(const Course& course) {
    std::string text = fmt::format(
        "<p class=\"legend\">Best points. &#10003; is passed; a number alone has been tried and is not "
        "passed; {} has not been tried; ! is overdue.</p><div class=\"wide\"><table "
        "class=\"matrix{}\"><thead><tr><th></th>",
        none, course.learners.size() > 8 ? " many" : "");
    for (const LearnerCourse& learner : course.learners)
        text += fmt::format("<th><a href=\"#learner-{}\"><span>{}</span></a></th>", course.place(learner),
                            name_of(learner));
    text += "</tr></thead><tbody>";
    const std::vector<PlannedExercise>& exercises = course.plan.exercises;
    const bool by_level = std::ranges::is_sorted(exercises, [](const auto& a, const auto& b) {
        return (a.level > 0 ? a.level : 99) < (b.level > 0 ? b.level : 99);
    });
    int level = -1;
    for (std::size_t k = 0; k < exercises.size(); ++k) {
        if (!course.shows(k)) continue;
        const PlannedExercise& exercise = exercises[k];
        const std::string its_level =
            exercise.level > 0 ? fmt::format("Level {}", exercise.level) : std::string("Outside the levels");
        if (by_level && exercise.level != level)
            text += fmt::format("<tr class=\"group\"><th colspan=\"{}\">{}</th></tr>",
                                course.learners.size() + 1, its_level);
        level = exercise.level;
        text += fmt::format("<tr><td>{}<small>{}{}, {:g} points pass{}</small></td>", name_of(exercise),
                            html_escaped(exercise.name), by_level ? "" : ", " + its_level, exercise.pass,
                            exercise.due ? ", due " + day_text(*exercise.due) : "");
        for (const LearnerCourse& learner : course.learners)
            text += matrix_cell(learner.exercises[k], course.today);
        text += "</tr>";
    }
    return text + "</tbody></table></div>";
}

std::string falling_text(const Falling& falling) {
    return fmt::format("{}: {:.0f}, {:.0f}, {:.0f} points", name_of(*falling.exercise), falling.points[0],
                       falling.points[1], falling.points[2]);
}

/// Who is to be spoken to, a line for each reason.
std::string at_a_glance(const Course& course) {
    std::map<int, std::string> found;
    const auto say = [&](int reason, const LearnerCourse& learner, const std::string& more) {
        found[reason] += fmt::format("{}<a href=\"#needs-{}\">{}</a>{}", found[reason].empty() ? "" : ", ",
                                     course.place(learner), name_of(learner), more);
    };
    for (const LearnerCourse& learner : course.learners) {
        const std::optional<int> idle = learner.idle(course.today);
        if (learner.attempts.empty()) say(0, learner, "");
        if (const std::size_t late = learner.overdue(course.today).size(); late > 0)
            say(1, learner, fmt::format(" ({})", late));
        if (idle && *idle >= course.plan.idle_days) say(2, learner, " (" + counted(*idle, "day") + ")");
        if (!learner.falling().empty()) say(3, learner, "");
        if (!learner.expected) say(4, learner, "");
    }
    if (found.empty()) return "<p>Nobody is overdue, idle or getting worse.</p>";
    const std::string reasons[] = {
        "No attempt yet", "Overdue",
        fmt::format("Not trained for {} or more", counted(course.plan.idle_days, "day")),
        "Last attempts get worse", fmt::format("Not on the list of {}", course_file)};
    std::string text = "<ul>";
    for (const auto& [reason, who] : found)
        text += fmt::format("<li><b>{}:</b> {}</li>", reasons[reason], who);
    return text + "</ul>";
}

std::string card(const Course& course, const LearnerCourse& learner) {
    std::string text =
        fmt::format("<article class=\"card\" id=\"needs-{0}\"><h3><a href=\"#learner-{0}\">{1}</a></h3>",
                    course.place(learner), name_of(learner));
    const Standing* next = learner.next();
    if (next)
        text += fmt::format(
            "<p><b>Next:</b> {}{}</p>", name_of(*next->exercise),
            next->best ? fmt::format(", best so far {:.0f} of {:g} points", *next->best, next->exercise->pass)
                       : "");
    else if (!learner.exercises.empty())
        text += "<p><b>Next:</b> nothing; every exercise is passed.</p>";
    for (const Standing* late : learner.overdue(course.today))
        text += fmt::format("<p><b>Overdue:</b> {}, since {}</p>", name_of(*late->exercise),
                            day_text(*late->exercise->due));
    const std::optional<int> idle = learner.idle(course.today);
    if (idle && *idle >= course.plan.idle_days)
        text += fmt::format("<p><b>Not trained</b> for {}.</p>", counted(*idle, "day"));
    for (const Falling& falling : learner.falling())
        text += fmt::format("<p><b>Getting worse</b> at {}</p>", falling_text(falling));
    if (learner.attempts.empty()) return text + "<p>No attempt yet.</p></article>";
    const std::size_t recent = std::min(learner.attempts.size(), recent_attempts);
    const std::size_t missed = static_cast<std::size_t>(
        std::count_if(learner.attempts.end() - static_cast<std::ptrdiff_t>(recent), learner.attempts.end(),
                      [](const CourseRow* row) { return !row->reached; }));
    if (missed > 0)
        text += fmt::format("<p><b>Target missed</b> in {} of the last {}.</p>", missed,
                            counted(recent, "attempt"));
    const std::vector<Costly> costly = learner.costly();
    if (costly.empty()) return text + "<p>Nothing costs points worth a word.</p></article>";
    text += "<ul>";
    for (const Costly& line : costly)
        text +=
            fmt::format("<li><b>{}</b>{} {}</li>", line.what,
                        line.points > 0 ? fmt::format(" costs {:.0f} points an attempt.", line.points) : ".",
                        line.advice);
    return text + "</ul></article>";
}

std::string errors_text(const CourseRow& row) {
    std::string text;
    for (std::size_t k = 0; k < row.errors.size(); ++k)
        if (row.errors[k] > 0)
            text += fmt::format("{}{}{}", text.empty() ? "" : "; ", exercise::handling_error_texts[k],
                                row.errors[k] > 1 ? fmt::format(" ({} times)", row.errors[k]) : "");
    if (text.empty()) text = "none";
    if (!row.teacher.empty())
        text += fmt::format("<small>the teacher: {}</small>", html_escaped(row.teacher));
    return text;
}

std::string attempts_table(std::span<const CourseRow* const> rows, const CoursePlan& plan) {
    std::string text =
        "<div class=\"wide\"><table><thead><tr><th>day</th><th class=\"text what\">exercise</th><th "
        "class=\"text\">page</th><th>attempt</th><th>points</th><th class=\"text\">result</th><th>time, "
        "s</th><th>K<sub>a,r</sub>, mGy</th><th>P<sub>KA</sub>, Gy·cm²</th><th>contrast, "
        "ml</th><th>angio&shy;grams</th><th class=\"text what\">errors of handling</th></tr></thead><tbody>";
    for (const CourseRow* row : rows) {
        const PlannedExercise* asked = plan.find(row->exercise);
        const bool passed = row->passes(asked ? asked->pass : plan.pass);
        const std::string link = row->debriefing.empty() ? none
                                                         : fmt::format("<a href=\"{}\">debriefing</a>",
                                                                       html_escaped(row->debriefing));
        std::string result = passed ? "&#10003; passed" : row->reached ? "reached" : "missed";
        if (row->steps) result += fmt::format(", {} of {} steps", row->steps->first, row->steps->second);
        text += fmt::format(
            "<tr><td class=\"day\">{}</td><td class=\"text\">{}<small>{}</small></td><td "
            "class=\"text\">{}</td>"
            "<td>{}</td><td>{}</td><td class=\"text "
            "state{}\">{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
            "<td>{}</td><td class=\"text\">{}</td></tr>",
            row->day ? day_text(*row->day) : none,
            html_escaped(row->title.empty() ? row->exercise : row->title),
            html_escaped(std::filesystem::path(row->file).filename().string()), link, row->attempt,
            number(row->points, 0), passed ? " passed" : "", result, number(row->time, 1),
            dose(row->air_kerma), dose(row->area_product), number(row->contrast, 1), row->angiograms,
            errors_text(*row));
    }
    return text + "</tbody></table></div>";
}

/// What balloons and stents made of it, a line for each attempt. Empty where there was nothing to treat.
std::string treatment_table(std::span<const CourseRow* const> rows) {
    const auto two = [](const std::optional<double>& proximal, const std::optional<double>& distal,
                        const char* form) {
        const auto text = [form](const std::optional<double>& value) {
            return value ? fmt::format(fmt::runtime(form), *value) : std::string(none);
        };
        return proximal || distal ? text(proximal) + " / " + text(distal) : std::string(none);
    };
    std::string body;
    for (const CourseRow* row : rows) {
        if (!row->treatment) continue;
        const exercise::WorstTreatment& t = *row->treatment;
        body += fmt::format(
            "<tr><td class=\"day\">{}</td><td "
            "class=\"text\">{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
            "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            row->day ? day_text(*row->day) : none,
            html_escaped(row->title.empty() ? row->exercise : row->title), row->attempt,
            number(t.residual, 0), number(t.lumen, 2), number(t.gradient, 0), number(t.covered, 0),
            two(t.missed_proximal, t.missed_distal, "{:.1f}"), two(t.proximal_off, t.distal_off, "{:+.1f}"),
            t.dissections_left > 0 ? fmt::format("{}, {} left", t.dissections, t.dissections_left)
                                   : fmt::format("{}", t.dissections),
            t.ruptures, t.bursts, t.inflations, number(t.balloon_to_artery, 2));
    }
    if (body.empty()) return "";
    return "<h4>Balloons and stents</h4><div class=\"wide\"><table "
           "class=\"treated\"><thead><tr><th>day</th><th class=\"text "
           "what\">exercise</th><th>attempt</th><th>residual stenosis, %</th><th>lumen, mm</th><th>gradient, "
           "mmHg</th><th>covered by stents, %</th><th>missed at its ends, mm</th><th>stent's ends off plan, "
           "mm</th><th>dissec&shy;tions</th><th>rup&shy;tures</th><th>bursts</th><th>infla&shy;tions</th>"
           "<th>balloon to artery</th></tr></thead><tbody>" +
           body + "</tbody></table></div>";
}

std::string learner_section(const Course& course, const LearnerCourse& learner) {
    std::string text = fmt::format("<section class=\"learner\" id=\"learner-{}\"><h3>{}</h3>",
                                   course.place(learner), name_of(learner));
    if (learner.attempts.empty()) return text + "<p>No attempt yet.</p></section>";
    text +=
        "<table><thead><tr><th></th><th class=\"text\">state</th><th>best</th><th>last</th><th>attempts</th>"
        "<th class=\"text\">points of each</th></tr></thead><tbody>";
    for (const Standing& standing : learner.exercises) {
        if (standing.attempts.empty()) continue;
        const bool reached =
            std::ranges::any_of(standing.attempts, [](const CourseRow* row) { return row->reached; });
        text += fmt::format(
            "<tr><td>{}<small>{}</small></td><td "
            "class=\"text{}\">{}{}</td><td>{}</td><td>{}</td><td>{}</td><td "
            "class=\"text\">{}</td></tr>",
            name_of(*standing.exercise), html_escaped(standing.exercise->name),
            standing.passed ? " passed" : "",
            standing.passed ? "&#10003; passed"
            : reached       ? "reached, not passed"
                            : "target missed",
            standing.overdue(course.today) ? ", overdue" : "", number(standing.best, 0),
            number(standing.last, 0), standing.attempts.size(), curve(standing));
    }
    text += "</tbody></table>";
    std::vector<const CourseRow*> inside;
    for (const CourseRow* row : learner.attempts)
        if (course.plan.find(row->exercise)) inside.push_back(row);
    if (!inside.empty())
        text += fmt::format("<details><summary>{}, with dose, errors and debriefing</summary>{}{}</details>",
                            counted(inside.size(), "attempt"), attempts_table(inside, course.plan),
                            treatment_table(inside));
    return text + "</section>";
}

/// Errors of handling, how many an attempt.
std::string errors_table(const Course& course) {
    std::string head = "<div class=\"wide\"><table class=\"matrix\"><thead><tr><th></th>";
    std::vector<const LearnerCourse*> shown;
    for (const LearnerCourse& learner : course.learners)
        if (!learner.attempts.empty()) {
            shown.push_back(&learner);
            head += fmt::format("<th>{}</th>", name_of(learner));
        }
    const auto line = [&](const char* what, const auto& count_of) {
        std::string cells;
        double all = 0;
        for (const LearnerCourse* learner : shown) {
            double sum = 0;
            for (const CourseRow* row : learner->attempts) sum += count_of(*row);
            all += sum;
            const double each = sum / static_cast<double>(learner->attempts.size());
            cells += each > 0 ? fmt::format("<td>{:.1f}</td>", each) : fmt::format("<td>{}</td>", none);
        }
        return all > 0 ? fmt::format("<tr><td>{}</td>{}</tr>", what, cells) : std::string();
    };
    std::string body;
    for (std::size_t k = 0; k < exercise::handling_error_kinds; ++k)
        body += line(exercise::handling_error_texts[k], [k](const CourseRow& row) { return row.errors[k]; });
    body += line("Branches were entered that do not lead to the target",
                 [](const CourseRow& row) { return row.wrong_entries; });
    if (body.empty()) return "<p>None.</p>";
    return head + "</tr></thead><tbody>" + body + "</tbody></table></div>";
}

std::string outside(const Course& course) {
    std::string text;
    for (const LearnerCourse& learner : course.learners) {
        std::vector<const CourseRow*> rows;
        for (const CourseRow* row : learner.attempts)
            if (!course.plan.find(row->exercise)) rows.push_back(row);
        if (!rows.empty())
            text += fmt::format("<h3>{}</h3>{}{}", name_of(learner), attempts_table(rows, course.plan),
                                treatment_table(rows));
    }
    return text.empty() ? "" : "\n<h2>Attempts outside the course</h2>" + text;
}

/// The file and the folder that it is in.
std::string short_name(const std::filesystem::path& file) {
    return (file.parent_path().filename() / file.filename()).string();
}

std::string uncounted(std::span<const CourseRow> rows) {
    std::string text;
    for (const CourseRow& row : rows)
        if (!row.problem.empty())
            text +=
                fmt::format("<li>{}: {}</li>", html_escaped(short_name(row.file)), html_escaped(row.problem));
    return text.empty() ? "" : "\n<h2>Files that do not count</h2><ul>" + text + "</ul>";
}

std::string meanings() {
    return fmt::format(
        "\n<h2>What the figures mean</h2><dl><dt>Points</dt><dd>{}</dd><dt>Passed</dt><dd>An attempt reached "
        "the "
        "target with at least the points asked for; where an exercise has no skilled attempts to be held "
        "against, an attempt that reached the target.</dd><dt>What costs most</dt><dd>The {} dearest lines "
        "of "
        "the grade over the learner's last {} attempts at whatever exercise, from {:g} points an attempt "
        "on.</dd><dt>Getting worse</dt><dd>Three attempts running at one exercise, each with fewer points "
        "than "
        "the one before, by {:g} or more in all. It may be chance.</dd><dt>K<sub>a,r</sub>, air kerma at the "
        "reference point</dt><dd>The dose to the skin, where the beam stayed in one "
        "place.</dd><dt>P<sub>KA</sub>, "
        "kerma-area product</dt><dd>What the whole field received; risk to patient and staff goes with "
        "it.</dd><dt>Angiograms</dt><dd>Injections that the beam showed.</dd><dt>Day</dt><dd>On which the "
        "attempt was begun, as its recording says; where it does not, its file was last "
        "written.</dd><dt>Points of each</dt><dd>Attempts "
        "in "
        "order; the dashed line passes, a ring did not reach the target.</dd><dt>Balloons and "
        "stents</dt><dd>Raw values at the attempt's end; of several lesions the worst. Missed is the length "
        "of "
        "the lesion that no stent reaches, at its proximal and its distal end. Off plan is how far the "
        "stent's "
        "proximal and distal ends lie from where the exercise wants them, + too far distal. Dissections and "
        "ruptures are the balloon's; those left have no stent over them. Balloon to artery is the widest "
        "that "
        "an inflated balloon opened a vessel, over its diameter without plaque.</dd></dl>",
        html_escaped(exercise::grade_formula), most_costly, recent_attempts, least_cost, clear_fall);
}

/// Without a list of exercises others that were tried belong to the course too, each at its level.
CoursePlan whole_plan(std::span<const CourseRow> rows, CoursePlan plan) {
    if (plan.lists_exercises) return plan;
    for (const CourseRow& row : rows)
        if (row.problem.empty() && !plan.find(row.exercise))
            plan.exercises.push_back({row.exercise, row.title, row.level, plan.pass});
    std::ranges::stable_sort(plan.exercises, [](const auto& a, const auto& b) {
        return (a.level > 0 ? a.level : 99) < (b.level > 0 ? b.level : 99);
    });
    return plan;
}

}  // namespace

std::string course_page(std::span<const CourseRow> rows, const CoursePlan& asked, const std::string& title,
                        Day today) {
    const CoursePlan plan = whole_plan(rows, asked);
    const Course course{plan, learners_of(rows, plan), today};
    std::size_t attempts = 0, exercises = 0;
    for (const LearnerCourse& learner : course.learners) attempts += learner.attempts.size();
    for (std::size_t k = 0; k < plan.exercises.size(); ++k) exercises += course.shows(k);
    const std::size_t bad = rows.size() - attempts;
    std::string text = fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
        "content=\"width=device-width\"><meta http-equiv=\"Content-Security-Policy\" content=\"default-src "
        "'none'; style-src 'unsafe-inline'\"><title>Course: {0}</title><style>{1}{2}</style></head><body>\n"
        "<header><h1>{0}</h1><p class=\"about\">Course of {3}, {4}, {5}{6}. As of {7}.</p></header>",
        html_escaped(title), page_style, course_style, counted(course.learners.size(), "learner"),
        counted(exercises, "exercise"), counted(attempts, "attempt"),
        bad > 0 ? fmt::format(", {} that {} not count", counted(bad, "file"), bad == 1 ? "does" : "do") : "",
        day_text(today));
    if (attempts > 0 || !plan.learners.empty()) {
        text += "\n<h2>Whom to speak to</h2>" + at_a_glance(course);
        text += "\n<h2>Learners and exercises</h2>" + matrix(course);
        text += "\n<h2>Who needs what</h2><div class=\"cards\">";
        for (const LearnerCourse& learner : course.learners) text += card(course, learner);
        text += "</div>\n<h2>Every learner's attempts</h2>";
        for (const LearnerCourse& learner : course.learners) text += learner_section(course, learner);
        text += "\n<h2>Errors of handling per attempt</h2>" + errors_table(course);
    }
    text += outside(course) + uncounted(rows) + meanings();
    return io::as_utf8(text) + "</body></html>\n";
}

}  // namespace debrief
