/// A class on one page, as a teacher makes it and as a browser shows it.

#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/io/text.h"
#include "tests/app/pages.h"
#include "tests/cases.h"

namespace app {
namespace {

using test::asset, test::browse, test::clumsy, test::expect_refused, test::expect_said, test::good_script,
    test::joined, test::Outcome, test::put, test::read, test::recorded, test::run, test::TemporaryFolder,
    test::write;

/// The links of a page to other files.
std::set<std::string> links_of(const std::string& page) {
    std::set<std::string> links;
    for (std::size_t at = page.find("href=\""); at != std::string::npos; at = page.find("href=\"", at)) {
        at += 6;
        const std::string link = page.substr(at, page.find('"', at) - at);
        if (!link.starts_with("#")) links.insert(link);
    }
    return links;
}

/// The rows of a table, by the names of its columns; no cell may hold a comma.
std::vector<std::map<std::string, std::string>> rows_of(const std::string& csv) {
    std::vector<std::map<std::string, std::string>> rows;
    std::vector<std::string> names;
    for (const std::string_view line : io::split(csv, '\n')) {
        const std::vector<std::string_view> cells = io::split(line, ',');
        if (names.empty()) {
            names.assign(cells.begin(), cells.end());
        } else if (!line.empty()) {
            std::map<std::string, std::string>& row = rows.emplace_back();
            for (std::size_t k = 0; k < std::min(names.size(), cells.size()); ++k) row[names[k]] = cells[k];
        }
    }
    return rows;
}

/// An exercise of one's own with its skilled attempts, in `own` of the folder.
void make_own_exercise(const TemporaryFolder& folder) {
    std::filesystem::create_directories(folder / "own");
    write(folder / "own/mine.toml",
          test::replaced(read(asset("scenarios/straight.toml")), "title = \"Straight", "title = \"Mine"));
    write(folder / "own/benchmark.toml",
          "schema = 1\n[mine]\nby = \"me\"\nattempts = 2\ncompleted_after_s = [1.0, 1.2]\n"
          "wire_travel_mm = [90, 100]\n");
}

/// Ada and Ben at three exercises, two that ship and one of the teacher's own, in folders as the room keeps
/// them.
void record_class(const TemporaryFolder& folder) {
    make_own_exercise(folder);
    const std::map<std::string, std::string> exercises = {{"straight", asset("scripts/straight.gw")},
                                                          {"s_bend", good_script},
                                                          {"mine", asset("scripts/straight.gw")}};
    for (const std::string learner : {"Ada <A>", "Ben #2"})
        for (const auto& [name, script] : exercises) {
            const std::filesystem::path home = folder / ("class/" + io::file_name_of(learner));
            std::filesystem::create_directories(home);
            const std::string scenario = name == "mine" ? (folder / "own/mine.toml").string() : name;
            succeeded(folder, {"run", scenario, "--commands", script, "--frames", "none", "--learner",
                               learner, "--out", folder / "out"});
            std::filesystem::copy_file(folder / "out/run.gw", home / (name + "-001.gw"));
        }
}

}  // namespace

using CourseCommand = test::InFolder;

TEST_F(CourseCommand, CountsAttemptsByLearnerAndExercise) {
    std::filesystem::create_directories(folder / "class/below");
    put(folder, recorded(folder, "a", clumsy), "1.gw");
    put(folder, recorded(folder, "b", read(good_script)), "below/2.gw");
    put(folder, recorded(folder, "c", read(good_script), "<b>Bob</b>"), "3.gw");
    write(folder / "class/broken.gw", "recording 3\n0 beam\n");
    std::string changed = read(folder / "b.gw");
    char& digit = changed[changed.find("state 20 ") + 9];
    digit = digit == '0' ? '1' : '0';
    write(folder / "class/changed.gw", changed);
    const auto made = succeeded(folder, {"course", folder / "class", "--out", folder / "out"});
    test::expect_said(made.out, "3 attempts");
    test::expect_said(made.out, "2 files that do not count");
    const std::string csv = read(folder / "out/course.csv"), page = read(folder / "out/course.html");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 6);
    test::expect_said(csv, "Ada,s_bend,1,2,");
    test::expect_said(page, "&lt;b&gt;Bob&lt;/b&gt;");
    EXPECT_EQ(page.find("<b>Bob"), std::string::npos);
    test::expect_said(page, "2 learners, 1 exercise, 3 attempts");
    // A second look finds the figures.
    run(folder, {"course", folder / "class", "--out", folder / "again"});
    EXPECT_EQ(read(folder / "again/course.csv"), csv);
}

TEST_F(CourseCommand, WritesValidUtf8WhateverItReads) {
    std::filesystem::create_directory(folder / "class");
    std::string text = read(recorded(folder, "one", "0 beam on\n2 advance 2 mm\n3 end\n", "Anna"));
    text.replace(text.find("learner Anna"), 12, "learner \xc4nna");  // as an earlier version took it
    write(folder / "class/\xfc.gw", text);
    ASSERT_EQ(run(folder, {"course", folder / "class"}).code, 0);
    for (const char* name : {"class/course.csv", "class/course.html"}) {
        const std::string made = read(folder / name);
        EXPECT_TRUE(io::is_utf8(made)) << name;
        EXPECT_NE(made.find("\uFFFDnna"), std::string::npos) << name;
    }
    ASSERT_EQ(
        run(folder, {"debrief", folder / "class/\xfc.gw", "--no-pictures", "--out", folder / "page"}).code,
        0);
    EXPECT_TRUE(io::is_utf8(read(folder / "page/debrief.html")));
}

TEST_F(CourseCommand, AnEmptyFolderIsRefused) {
    std::filesystem::create_directory(folder / "none");
    expect_refused(run(folder, {"course", folder / "none"}), "no recordings");
    expect_refused(run(folder, {"course", folder / "nowhere"}),
                   "nowhere: expected a folder with recordings (.gw), found none");
}

TEST_F(CourseCommand, TakesTenThousandFiles) {
    std::filesystem::create_directory(folder / "many");
    const std::string text = read(recorded(folder, "one", "0 beam on\n2 advance 2 mm\n3 end\n"));
    for (int k = 0; k < 10'000; ++k) write(folder / ("many/" + std::to_string(k) + ".gw"), text);
    succeeded(folder, {"course", folder / "many", "--out", folder / "out"});
    const std::string csv = read(folder / "out/course.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 10'001);
}

TEST_F(CourseCommand, FromRecordingsToThePageThatABrowserOpensAndEveryLinkLeadsToItsDebriefing) {
    record_class(folder);
    write(folder / "class/course.toml",
          "schema = 1\ntitle = \"Autumn\"\nlearners = [\"Ada <A>\", \"Ben #2\", \"Cleo\"]\n"
          "[[exercise]]\nname = \"straight\"\npass = 1\n[[exercise]]\nname = \"s_bend\"\ndue = 2020-01-31\n"
          "[[exercise]]\nname = \"mine\"\n");
    const std::vector<std::string> command = {"course", folder / "class", "--scenarios", folder / "own"};
    expect_said(succeeded(folder, command).out, "6 recordings have no debriefing: --debrief makes them");
    EXPECT_TRUE(links_of(read(folder / "class/course.html")).empty());
    succeeded(folder, joined(command, {"--debrief", "--no-pictures"}));
    // The folder can be moved.
    std::filesystem::rename(folder / "class", folder / "moved");
    const std::string page = read(folder / "moved/course.html");
    for (const char* part : {"<h1>Autumn</h1>", "3 learners, 3 exercises, 6 attempts", "Mine",
                             "No attempt yet", "due 2020-01-31", "&#10003; passed", "Who needs what"})
        expect_said(page, part);
    const std::set<std::string> links = links_of(page);
    EXPECT_EQ(links.size(), 6u);
    for (const auto& row : rows_of(read(folder / "moved/course.csv"))) {
        EXPECT_TRUE(links.contains(row.at("debriefing"))) << row.at("debriefing");
        EXPECT_NE(row.at("points"), "") << row.at("exercise");  // the own one has its benchmark beside it
        EXPECT_NE(row.at("air_kerma_mGy"), "");
    }
    if (!std::filesystem::exists(test::chromium))
        GTEST_SKIP() << test::chromium << " is missing (app/setup.sh): no page was opened";
    const std::string home = "file://" + folder.path().string() + "/moved/";
    const Outcome opened = browse(folder, {"--dump-dom", home + "course.html"});
    ASSERT_EQ(opened.code, 0) << opened.error;
    EXPECT_EQ(opened.error.find("CONSOLE"), std::string::npos) << opened.error;
    expect_said(opened.out, "Who needs what");
    for (const std::string& link : links) {
        // The browser itself clicks it, in a copy that may run a script.
        std::string copy = test::replaced(page, "default-src 'none'", "script-src 'unsafe-inline'");
        copy.insert(copy.find("</body>"),
                    "<script>addEventListener('load', () => document.querySelector('a[href=\"" + link +
                        "\"]').click());</script>");
        write(folder / "moved/clicked.html", copy);
        const Outcome clicked = browse(folder, {"--dump-dom", home + "clicked.html"});
        ASSERT_EQ(clicked.code, 0) << clicked.error;
        expect_said(clicked.out,
                    link.starts_with("Ada") ? "Debriefing of Ada &lt;A&gt;" : "Debriefing of Ben #2");
        EXPECT_EQ(clicked.error.find("CONSOLE"), std::string::npos) << link << clicked.error;
    }
}

/// What a page says in the cells of the first row of the table after its header.
std::vector<std::string> first_cells(const std::string& page, const std::string& table) {
    std::size_t at = page.find(table);
    if (at == std::string::npos) return {};
    at = page.find("<tbody>", at);
    const std::size_t end = page.find("</tr>", at);
    std::vector<std::string> cells;
    while ((at = page.find("<td", at)) < end) {
        at = page.find('>', at) + 1;
        cells.push_back(page.substr(at, page.find("</td>", at) - at));
    }
    return cells;
}

TEST_F(CourseCommand, ShowsWhatATreatmentCameTo) {
    std::filesystem::create_directories(folder / "class");
    succeeded(folder, {"run", "iliac_stent", "--commands", "solution", "--frames", "none", "--learner", "Ada",
                       "--out", folder / "out"});
    put(folder, folder / "out/run.gw", "1.gw");
    put(folder, recorded(folder, "b", "0 beam on\n3 advance 2 mm\n9 end\n"), "2.gw");
    succeeded(folder, {"course", folder / "class"});
    const auto score = nlohmann::json::parse(read(folder / "out/score.json"));
    const auto& treatment = score.at("treatment");
    ASSERT_EQ(treatment.at("lesions").size(), 1u);
    const auto &after = treatment.at("lesions")[0].at("after"),
               &stented = treatment.at("lesions")[0].at("stented");
    const auto text = [](const auto& json, const char* key, const char* form) {
        return fmt::format(fmt::runtime(form), json.at(key).template get<double>());
    };
    const std::string page = read(folder / "class/course.html");
    const std::vector<std::string> shown = first_cells(page, "class=\"treated\"");
    const std::vector<std::string> wanted = {
        "1",
        text(after, "residual_percent", "{:.0f}"),
        text(after, "lumen_mm", "{:.2f}"),
        text(after, "gradient_mmHg", "{:.0f}"),
        text(stented, "covered_percent", "{:.0f}"),
        text(stented, "missed_proximal_mm", "{:.1f}") + " / " + text(stented, "missed_distal_mm", "{:.1f}"),
        text(stented, "proximal_off_plan_mm", "{:+.1f}") + " / " +
            text(stented, "distal_off_plan_mm", "{:+.1f}"),
        text(treatment, "dissections", "{:.0f}"),
        text(treatment, "ruptures", "{:.0f}"),
        text(treatment, "bursts", "{:.0f}"),
        text(treatment, "inflations", "{:.0f}"),
        text(treatment, "balloon_to_artery", "{:.2f}")};
    ASSERT_EQ(shown.size(), wanted.size() + 2);
    EXPECT_EQ(std::vector<std::string>(shown.begin() + 2, shown.end()), wanted);
    for (const auto& row : rows_of(read(folder / "class/course.csv"))) {
        const bool treats = row.at("exercise") == "iliac_stent";
        for (const auto& [column, json, key] :
             {std::tuple("residual_percent", after, "residual_percent"),
              std::tuple("stent_covered_percent", stented, "covered_percent"),
              std::tuple("distal_off_plan_mm", stented, "distal_off_plan_mm"),
              std::tuple("balloon_to_artery", treatment, "balloon_to_artery")})
            if (treats)
                EXPECT_NEAR(std::stod(row.at(column)), json.at(key).get<double>(), 1e-4) << column;
            else
                EXPECT_EQ(row.at(column), "") << column;
    }
}

TEST_F(CourseCommand, TakesDebriefingsThatAreThereAndMakesOthersWhereItWrites) {
    std::filesystem::create_directories(folder / "class");
    put(folder, recorded(folder, "a", "0 beam on\n2 advance 2 mm\n9 end\n"), "1.gw");
    put(folder, recorded(folder, "b", "0 beam on\n3 advance 2 mm\n9 end\n"), "2.gw");
    write(folder / "class/1.html", "made before");
    succeeded(folder, {"course", folder / "class", "--debrief", "--no-pictures", "--out", folder / "page"});
    EXPECT_EQ(read(folder / "class/1.html"), "made before");
    EXPECT_FALSE(std::filesystem::exists(folder / "class/2.html"));
    expect_said(read(folder / "page/2.html"), "Learning curve");  // with the attempt before
    EXPECT_EQ(links_of(read(folder / "page/course.html")),
              (std::set<std::string>{"../class/1.html", "2.html"}));
}

TEST_F(CourseCommand, RefusesAPlanWithErrorsBeforeAnythingIsPlayed) {
    std::filesystem::create_directories(folder / "class");
    put(folder, recorded(folder, "a", "0 beam on\n2 advance 2 mm\n9 end\n"), "1.gw");
    write(folder / "class/course.toml", "schema = 1\n[[exercise]]\nname = \"renl\"\n");
    expect_refused(run(folder, {"course", folder / "class"}), "course.toml:3:");
    write(folder / "other.toml", "schema = 1\n[[exercise]]\nname = \"../x\"\n");
    expect_refused(run(folder, {"course", folder / "class", "--course", folder / "other.toml"}),
                   "other.toml:3:");
    expect_refused(run(folder, {"course", folder / "class", "--course", folder / "none.toml"}), "none.toml");
    expect_refused(run(folder, {"course", folder / "class", "--no-pictures"}), "--debrief");
    EXPECT_FALSE(std::filesystem::exists(folder / "class/course.html"));
}

}  // namespace app
