#include <map>
#include <random>

#include "engine/debrief/course_learner.h"
#include "engine/debrief/course_page.h"
#include "engine/exercise/grade.h"
#include "engine/io/error.h"
#include "tests/engine/debrief/html.h"

namespace debrief {
namespace {

using test::expect_said, test::refusal;

const std::string example = R"(schema = 1
title = "Angiography"
pass = 65
idle_days = 10
learners = ["Ada", "Ben"]
[[exercise]]
name = "straight"
pass = 60
[[exercise]]
name = "renal"
due = 2026-12-24
)";

scenario::Scenario known(const std::string& name) {
    const std::map<std::string, int> levels = {{"straight", 1}, {"s_bend", 1}, {"renal", 2}};
    if (!levels.contains(name))
        throw io::InputError("{}: no such scenario; expected straight, s_bend, renal", name);
    scenario::Scenario scenario;
    scenario.name = name;
    scenario.title = "The " + name;
    scenario.lesson.level = levels.at(name);
    return scenario;
}

CoursePlan usual() {
    const std::vector<scenario::Scenario> exercises = {known("straight"), known("s_bend"), known("renal")};
    return usual_plan(exercises);
}
CoursePlan parsed(const std::string& toml) {
    return parse_plan(toml, "course.toml", known, usual());
}

constexpr Day today = std::chrono::year(2026) / 12 / 20;

CourseRow attempt(const std::string& learner, const std::string& exercise, double points, int days_ago = 0) {
    CourseRow row;
    row.learner = learner;
    row.exercise = exercise;
    row.title = "The " + exercise;
    row.level = exercise == "renal" ? 2 : 1;
    row.file = learner + ".gw";
    row.attempt = 1;
    row.reached = points > 0;
    row.points = points;
    row.day = today - std::chrono::days(days_ago);
    row.costs.assign(exercise::measures().size(), 0);
    return row;
}

std::size_t measure(std::string_view id) {
    for (std::size_t k = 0; k < exercise::measures().size(); ++k)
        if (exercise::measures()[k].id == id) return k;
    return 99;
}

}  // namespace

TEST(CoursePlan, IsReadAsItStandsAndHasTheCurriculumOtherwise) {
    const CoursePlan plan = parsed(example);
    ASSERT_EQ(plan.exercises.size(), 2u);
    EXPECT_TRUE(plan.lists_exercises);
    EXPECT_EQ(plan.exercises[0].pass, 60);
    EXPECT_EQ(plan.exercises[1].pass, 65);
    EXPECT_EQ(plan.exercises[1].title, "The renal");
    EXPECT_FALSE(plan.exercises[0].due);
    EXPECT_EQ(day_text(*plan.exercises[1].due), "2026-12-24");
    EXPECT_EQ(plan.learners, (std::vector<std::string>{"Ada", "Ben"}));
    EXPECT_EQ(plan.idle_days, 10);
    const CoursePlan bare = parsed("schema = 1\npass = 80\n");
    EXPECT_FALSE(bare.lists_exercises);
    ASSERT_EQ(bare.exercises.size(), 3u);
    EXPECT_EQ(bare.exercises[2].name, "renal");
    EXPECT_EQ(bare.exercises[2].pass, 80);
    EXPECT_EQ(usual().pass, exercise::pass_mark);
}

TEST(CoursePlan, WhatIsWrongIsSaidWithItsLineAndWhatWasExpected) {
    const auto said = [](const std::string& toml, const std::string& line, const std::string& accepted) {
        const std::string message = refusal([&] { parsed(toml); });
        expect_said(message, "course.toml:" + line);
        expect_said(message, accepted);
    };
    said(example + "name2 = 1\n", "12:", "unknown key 'name2'");
    said(example + "[[exercise]]\nname = \"renl\"\n", "13:", "expected straight, s_bend, renal");
    said(example + "[[exercise]]\nname = \"renal\"\n", "13:", "each exercise once");
    said(example + "[[exercise]]\n", "12:", "name = \"EXERCISE\" is missing");
    said("schema = 1\npass = 101\n", "2:", "expected a number from 0 to 100");
    said("schema = 1\nidle_days = 0\n", "2:", "a whole number from 1");
    said("schema = 1\nlearners = [\"Ada\", \"Ada\"]\n", "2:", "each once");
    said("schema = 1\nlearners = \"Ada\"\n", "2:", "a list of names in quotes");
    said("schema = 1\nlearners = [\"A\\nb\"]\n", "2:", "a list of names in quotes");
    said("schema = 1\n[[exercise]]\nname = \"renal\"\ndue = \"2026-12-24\"\n", "4:", "a date without quotes");
    said("schema = 1\n[[exercise]]\nname = \"renal\"\ndue = 2026-12-24T10:00:00\n",
         "4:", "a date without quotes");
    said("schema = 1\n[[exercise]]\nname = \"renal\"\ndue = 2026-13-24\n", "4:", "not TOML");
    said("schema = 1\nexercise = 3\n", "2:", "[[exercise]]");
}

TEST(CoursePlan, FiveHundredChangedFilesAreTakenOrRefusedWithFileAndLine) {
    std::mt19937 random(20261126);
    const auto below = [&random](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
    const std::string pieces[] = {
        "\"",           "[",  "]",   "=",   "\n", "\0x",         "\xff", "2026-99-99",
        "[[exercise]]", "-1", "nan", "'''", "{}", "\xe2\x80\xae"};
    int refused = 0;
    for (int k = 0; k < 500; ++k) {
        std::string text = example;
        for (std::size_t changes = 1 + below(3); changes > 0; --changes) {
            const std::size_t at = below(text.size());
            if (const std::size_t kind = below(3); kind == 0)
                text.erase(at, 1 + below(12));
            else if (kind == 1)
                text.insert(at, pieces[below(std::size(pieces))]);
            else
                text[at] = static_cast<char>(random() & 0xff);
        }
        const std::string message = refusal([&] { parsed(text); });
        if (message.empty()) continue;
        ++refused;
        EXPECT_TRUE(message.starts_with("course.toml:")) << message;
        // A key missing at the top has no line.
        const bool has_line = message.size() > 12 && std::isdigit(static_cast<unsigned char>(message[12]));
        EXPECT_TRUE(has_line || message.find("is missing") != std::string::npos) << message;
    }
    EXPECT_GT(refused, 200);
}

TEST(Course, TellsWhatComesNextWhatIsOverdueAndWhoHasNotTrained) {
    CoursePlan plan = parsed(example);
    plan.exercises[0].due = today - std::chrono::days(1);
    plan.exercises[1].due = today;  // still in time
    const std::vector<CourseRow> rows = {attempt("Ada", "straight", 59, 12),
                                         attempt("Ada", "s_bend", 99, 11)};
    const std::vector<LearnerCourse> learners = learners_of(rows, plan);
    ASSERT_EQ(learners.size(), 2u);
    EXPECT_EQ(learners[0].next()->exercise->name, "straight");
    ASSERT_EQ(learners[0].overdue(today).size(), 1u);
    EXPECT_EQ(learners[0].idle(today), 11);
    EXPECT_EQ(learners[0].attempts.size(), 2u);
    EXPECT_FALSE(learners[1].idle(today));
    const std::string page = course_page(rows, plan, "A", today);
    expect_said(page, "No attempt yet:</b> <a href=\"#needs-2\">Ben</a>");
    expect_said(page, "Overdue:</b> <a href=\"#needs-1\">Ada</a> (1)");
    expect_said(page, "Not trained for 10 days or more:</b> <a href=\"#needs-1\">Ada</a> (11 days)");
    expect_said(page, "Attempts outside the course</h2><h3>Ada</h3>");
    // One point more passes.
    const std::vector<CourseRow> better = {attempt("Ada", "straight", 60)};
    EXPECT_EQ(learners_of(better, plan)[0].next()->exercise->name, "renal");
    EXPECT_TRUE(learners_of(better, plan)[0].overdue(today).empty());
}

TEST(Course, ThreeAttemptsThatFallByTenPointsGetWorseAndOthersDoNot) {
    const auto falls = [](const std::vector<double>& points) {
        std::vector<CourseRow> rows;
        for (const double p : points) rows.push_back(attempt("Ada", "renal", p));
        const CoursePlan plan = parsed(example);
        return !learners_of(rows, plan)[0].falling().empty();
    };
    EXPECT_TRUE(falls({90, 85, 80}));
    EXPECT_TRUE(falls({20, 90, 85, 0}));
    EXPECT_FALSE(falls({90, 85, 81}));
    EXPECT_FALSE(falls({90, 70, 75}));
    EXPECT_FALSE(falls({90, 60}));
}

TEST(Course, WhatCostsMostIsToldOfTheLastFiveAttemptsDearestFirst) {
    const CoursePlan plan = parsed(example);
    std::vector<CourseRow> rows;
    for (int k = 0; k < 6; ++k) rows.push_back(attempt("Ada", "renal", 50));
    rows[0].costs[measure("time")] = 25;  // too long ago
    for (int k = 1; k < 6; ++k) {
        rows[k].costs[measure("travel")] = 4;
        rows[k].costs[measure("contrast")] = 0.4;
        rows[k].costs[measure("errors")] = 8;
        rows[k].errors[static_cast<std::size_t>(exercise::HandlingError::HardPress)] = 2;
        rows[k].errors[static_cast<std::size_t>(exercise::HandlingError::IdleBeam)] = 1;
    }
    rows[5].errors[static_cast<std::size_t>(exercise::HandlingError::Dissection)] = 1;
    const std::vector<Costly> costly = learners_of(rows, plan)[0].costly();
    ASSERT_EQ(costly.size(), 3u);
    EXPECT_EQ(costly[0].what, "Errors of handling, most of all: The wall was pressed hard (10 times)");
    EXPECT_EQ(costly[0].advice,
              exercise::handling_error_advice[static_cast<std::size_t>(exercise::HandlingError::HardPress)]);
    EXPECT_DOUBLE_EQ(costly[0].points, 8);
    EXPECT_EQ(costly[1].what, "Travel of the devices");
    EXPECT_EQ(costly[2].what, "The wall was dissected (1 time)");
    EXPECT_DOUBLE_EQ(costly[2].points, 3);  // 15 points, one attempt in five
    for (CourseRow& row : rows) {
        row.blind = true;
        for (const char* id : {"air_kerma", "area_product", "contrast"}) {
            const std::size_t k = measure(id);
            row.costs[k] = exercise::measures()[k].most;
        }
    }
    const std::vector<Costly> blind = learners_of(rows, plan)[0].costly();
    EXPECT_EQ(blind[0].what, "Going without looking");
    EXPECT_DOUBLE_EQ(blind[0].points, 35);
}

TEST(Course, AnExerciseWithoutBenchmarkIsPassedByReachingItsTarget) {
    CourseRow row = attempt("Ada", "straight", 1);
    row.points.reset();
    row.costs.clear();
    row.errors[static_cast<std::size_t>(exercise::HandlingError::AgainstStop)] = 3;
    const CoursePlan plan = parsed(example);
    const LearnerCourse learner = learners_of(std::span(&row, 1), plan)[0];
    EXPECT_TRUE(learner.exercises[0].passed);
    ASSERT_EQ(learner.costly().size(), 1u);
    expect_said(learner.costly()[0].what, "pushed against resistance (3 times)");
}

TEST(Course, WhatWasPassedOnceStaysPassedAndAMissedTargetNeverPasses) {
    CoursePlan plan = parsed(example);
    std::vector<CourseRow> rows = {attempt("Ada", "straight", 61), attempt("Ada", "straight", 10)};
    const Standing standing = learners_of(rows, plan)[0].exercises[0];
    EXPECT_TRUE(standing.passed);
    EXPECT_EQ(standing.best, 61);
    EXPECT_EQ(standing.last, 10);
    plan.exercises[0].pass = 0;
    rows = {attempt("Ada", "straight", 0)};
    EXPECT_FALSE(learners_of(rows, plan)[0].exercises[0].passed);
    rows[0].points.reset();
    EXPECT_FALSE(learners_of(rows, plan)[0].exercises[0].passed);
}

TEST(Course, ThePageOfAThousandRandomRowsIsWhole) {
    std::mt19937 random(7);
    const auto below = [&random](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const std::string names[] = {"Ada",
                                 "",
                                 "<b>Bob</b>",
                                 "O'Brien \"Q\" & <script>alert(1)</script>",
                                 "\u017d\u00f3\u0142\u0107 \u5f20\u4f1f",
                                 "=1+1",
                                 "\xc4nna",
                                 "a\x01"
                                 "b"};
    const std::string exercises[] = {"straight", "renal", "s_bend", "<i>own</i>"};
    std::vector<CourseRow> rows;
    for (int k = 0; k < 1000; ++k) {
        CourseRow row = attempt(names[below(8)], exercises[below(4)], below(101), below(40));
        if (below(5) == 0) row.points.reset();
        if (below(6) == 0) row.costs.clear();
        if (below(9) == 0) row.problem = "broken <a href=\"x\">";
        if (below(3) == 0) row.day.reset();
        if (below(2) == 0) row.debriefing = "a%20b/" + std::to_string(k) + ".html";
        if (below(3) == 0) row.air_kerma = below(1000) / 10.0;
        for (double& cost : row.costs) cost = below(20);
        for (int& error : row.errors) error = below(3);
        rows.push_back(row);
    }
    for (const CoursePlan& plan : {parsed(example), usual()}) {
        const std::string page = course_page(rows, plan, "<Course> & \"Co\"", today);
        EXPECT_EQ(test::unbalanced(page), "");
        for (const char* bad : {"<script", "<b>Bob", "<i>own", "broken <a", "<Course>", "\x01", "\xc4nna"})
            EXPECT_EQ(page.find(bad), std::string::npos) << bad;
        for (const std::string id : exercise::handling_error_ids)  // two are plain words, too
            if (id.find('_') != id.npos) {
                EXPECT_EQ(page.find(id), std::string::npos) << id;
            }
        EXPECT_EQ(page.find("http"), page.find("http-equiv"));
        expect_said(page, "&lt;b&gt;Bob&lt;/b&gt;");
    }
    EXPECT_EQ(test::unbalanced(course_page({}, usual(), "none", today)), "");
    EXPECT_EQ(test::unbalanced(course_page({}, parsed(example), "none", today)), "");
}

TEST(Course, NothingThatPassedIsPaintedAsBad) {
    std::vector<CourseRow> rows = {attempt("Ada", "straight", 0), attempt("Ada", "straight", 70)};
    const CoursePlan plan = parsed(example);
    const std::string page = course_page(rows, plan, "A", today);
    expect_said(page, "<td class=\"passed\">&#10003; 70<small>2 attempts</small></td>");
    EXPECT_EQ(page.find("class=\"worse\""), std::string::npos);
    EXPECT_EQ(page.find("class=\"missed\""), std::string::npos);
}

TEST(Course, ItsTableHasNewColumnsAtTheEndAndNoFormulas) {
    std::vector<CourseRow> rows;
    for (const char* name : {"=1+1", "+2", "-3", "@x", "a,\"b"}) rows.push_back(attempt(name, "renal", 65));
    rows[0].problem = "=cmd";
    rows[1].debriefing = "x.html";
    rows[1].area_product = 0.5;
    const std::string csv = course_csv(rows, parsed(example));
    std::vector<std::string> lines;
    std::istringstream stream(csv);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    ASSERT_EQ(lines.size(), 6u);
    EXPECT_TRUE(lines[0].starts_with(
        "learner,exercise,level,attempt,file,reached,points,time_s,beam_s,contrast_ml,travel_mm,peak_force_N,"
        "wrong_entries,errors,motion_without_beam,"));
    EXPECT_TRUE(lines[0].ends_with(
        ",perforation,problem,title,day,air_kerma_mGy,kerma_area_product_Gy_cm2,angiograms,pass_mark,passed,"
        "debriefing,steps_done,steps,patient,teacher,residual_percent,lumen_mm,gradient_mmHg,"
        "stent_covered_percent,missed_proximal_mm,missed_distal_mm,proximal_off_plan_mm,distal_off_plan_mm,"
        "balloon_to_artery,inflations,bursts,balloon_dissections,balloon_dissections_left,ruptures"));
    EXPECT_TRUE(lines[1].starts_with("'=1+1,renal,")) << lines[1];
    expect_said(lines[1], ",'=cmd,The renal,2026-12-20,");
    EXPECT_TRUE(lines[2].ends_with(",The renal,2026-12-20,,0.5,0,65,1,x.html,,,,,,,,,,,,,,,,,,")) << lines[2];
    EXPECT_TRUE(lines[3].starts_with("'-3,"));
    EXPECT_TRUE(lines[4].starts_with("'@x,"));
    EXPECT_TRUE(lines[5].starts_with("\"a,\"\"b\","));
}

TEST(Course, OfSeveralLesionsTheWorstCounts) {
    exercise::TreatmentScore score;
    for (const double sign : {1.0, -1.0}) {
        exercise::LesionScore& lesion = score.lesions.emplace_back();
        lesion.after.residual = 20 + 5 * sign;
        lesion.after.lumen = 3 - sign;
        exercise::StentedLesion& stented = lesion.stented.emplace();
        stented.covered = 80 - 10 * sign;
        stented.missed_proximal = 2 + sign, stented.missed_distal = 2 - sign;
        stented.proximal_off = sign * (3 + sign), stented.distal_off = sign * (3 - sign);
    }
    EXPECT_FALSE(exercise::worst_of(score).covered);  // without a stent
    score.stents.emplace_back();
    score.dissections = 3, score.dissections_left = 2;
    const exercise::WorstTreatment worst = exercise::worst_of(score);
    EXPECT_EQ(worst.residual, 25);
    EXPECT_EQ(worst.lumen, 2);
    EXPECT_FALSE(worst.gradient);
    EXPECT_EQ(worst.covered, 70);
    EXPECT_EQ(worst.missed_proximal, 3);
    EXPECT_EQ(worst.missed_distal, 3);
    EXPECT_EQ(worst.proximal_off, 4);
    EXPECT_EQ(worst.distal_off, -4);
    EXPECT_FALSE(worst.balloon_to_artery);
    CourseRow treated = attempt("Ada", "renal", 70), plain = attempt("Ben", "straight", 70);
    treated.treatment = CourseTreatment{worst};
    const std::string page = course_page(std::vector<CourseRow>{treated, plain}, parsed(example), "A", today);
    expect_said(page,
                "<td>25</td><td>2.00</td><td>&ndash;</td><td>70</td><td>3.0 / 3.0</td><td>+4.0 / "
                "-4.0</td><td>3, 2 left</td><td>0</td><td>0</td><td>0</td><td>&ndash;</td></tr>");
    EXPECT_EQ(test::unbalanced(page), "");
    const std::string table = "class=\"treated\"";
    EXPECT_EQ(page.find(table), page.rfind(table));  // Ben had nothing to treat
}

TEST(Course, LinksAreRelativeAndReadableByABrowser) {
    EXPECT_EQ(link_to("/a/class/Anna %2F/r-1.html", "/a/class"), "Anna%20%252F/r-1.html");
    EXPECT_EQ(link_to("/a/class/x#y?.html", "/a/out"), "../class/x%23y%3F.html");
    EXPECT_EQ(link_to("/a/class/\u017d.html", "/a/class"), "%C5%BD.html");
    EXPECT_EQ(debriefing_page("/a/class/b/1.gw", "/a/class", "/a/out"), "/a/out/b/1.html");
    // The course's own page is nobody's debriefing.
    EXPECT_EQ(debriefing_page("/a/class/course.gw", "/a/class", "/a/class"), "/a/class/course.gw.html");
}

}  // namespace debrief
