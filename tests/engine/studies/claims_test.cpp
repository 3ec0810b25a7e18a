#include "engine/studies/claims.h"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "engine/studies/study_files.h"

namespace studies {
namespace {

/// One claim of every class, and one that differs.
StudyResult one_of_each() {
    StudyResult result;
    FigureClaims fig(result, "Fig. 1", "Two joints & no more.");
    fig.published("\"half\" [%]", 50.0, 49.5, true, "within 1", "of 200");
    fig.published("best", std::string("10 to 20"), std::nan(""), false, "from 10 to 20", "because");
    fig.add(ClaimKind::Calibrated, "chosen by", 1.0, 1.01, true, "within 15 %");
    FigureClaims other(result, "Table 1");
    other.add(ClaimKind::Identity, "a sum", 3.0, 3.0, true, "");
    other.add(ClaimKind::Identity, "a broken sum", 3.0, 4.0, false, "");
    other.add(ClaimKind::Machine, "a time [s]", 0.2, 0.3, false, "");
    result.claims.push_back({"ours", 0.0, 0.0, true, ""});
    return result;
}

std::array<ClaimList, 1> list(const StudyResult& result) {
    return {ClaimList{"tiny", result.claims, result.notes}};
}

}  // namespace

TEST(Claims, AreCountedByClass) {
    const StudyResult result = one_of_each();
    const auto counts = claim_counts(list(result));
    const std::vector<std::tuple<std::string, int, int>> expected = {
        {"reproduced", 1, 1}, {"differs", 1, 0}, {"calibrated", 1, 1},
        {"identity", 2, 1},   {"machine", 1, 0}, {"extension", 1, 1}};
    ASSERT_EQ(counts.size(), expected.size());
    for (std::size_t k = 0; k < counts.size(); ++k)
        EXPECT_EQ(expected[k],
                  std::tuple(counts[k].first, counts[k].second.claims, counts[k].second.holding));
}

TEST(Claims, AsJsonKeepNumbersWordsAndWhatWasNotToBeHad) {
    const StudyResult result = one_of_each();
    const auto json = nlohmann::json::parse(claims_json(list(result)));
    EXPECT_EQ(json["counts"]["reproduced"]["claims"], 1);
    EXPECT_EQ(json["counts"]["identity"]["holding"], 1);
    EXPECT_EQ(json["counts"]["machine"]["claims"], 1);
    EXPECT_FALSE(json["counts"]["machine"].contains("holding"));  // times are reported, never counted
    const auto& claims = json["claims"];
    ASSERT_EQ(claims.size(), 7u);
    EXPECT_EQ(claims[0]["study"], "tiny");
    EXPECT_EQ(claims[0]["figure"], "Fig. 1");
    EXPECT_EQ(claims[0]["class"], "reproduced");
    EXPECT_EQ(claims[0]["text"], "\"half\" [%]");
    EXPECT_EQ(claims[0]["published"], 50.0);
    EXPECT_EQ(claims[0]["measured"], 49.5);
    EXPECT_EQ(claims[0]["holds"], true);
    EXPECT_EQ(claims[0]["rule"], "within 1");
    EXPECT_EQ(claims[0]["note"], "of 200");
    EXPECT_EQ(claims[1]["class"], "differs");
    EXPECT_EQ(claims[1]["published"], "10 to 20");
    EXPECT_TRUE(claims[1]["measured"].is_null());
    EXPECT_EQ(claims[6]["class"], "extension");
}

TEST(Claims, OfAPageStandUnderTheirFigureWithItsNoteOnce) {
    StudyResult result = one_of_each();
    const std::string page = claims_page("tiny", "A title", "How.", result, {});
    for (const char* part :
         {"### Fig. 1\n\nTwo joints & no more.", "### Table 1", "reproduced", "differs", "calibrated, holds",
          "identity, does not hold", "| machine |", "extension, holds"})
        EXPECT_NE(page.find(part), std::string::npos) << part;
    EXPECT_EQ(page.find("Two joints"), page.rfind("Two joints"));
    EXPECT_EQ(figures_of(result.claims), (std::vector<std::string>{"Fig. 1", "Table 1", ""}));
}

TEST(Claims, OfAllStudiesStandOnOnePageWithThePictures) {
    StudyResult result = one_of_each();
    result.plots = {{"picture", "", 900, 600, "a < b"}};
    result.tables = {{"numbers", {"x"}, {}}};
    const Study study{"tiny", "Is a < b?", nullptr};
    const std::string html = studies_html({{&study, result}}, true);
    for (const char* part :
         {"study all --quick", "src=\"tiny/picture.svg\"", "a &lt; b", "Is a &lt; b?", "&quot;half&quot;",
          "<td class=\"verdict differs\">differs</td>", "<td class=\"verdict reproduced\">reproduced</td>",
          "<td>–</td>", "tiny/numbers.csv", "Two joints &amp; no more.", "<td>1 of 2 hold</td>"})
        EXPECT_NE(html.find(part), std::string::npos) << part;
    EXPECT_EQ(html.find("a < b"), std::string::npos);
}

TEST(Claims, ThePageOpensWithThePictureOfSpeedAgainstAccuracy) {
    StudyResult first, pareto;
    first.plots = {{"other", "", 900, 600, ""}};
    pareto.plots = {{"speed", "", 900, 600, "what is seen"}, {"more", "", 900, 600, ""}};
    const Study one{"tiny", "?", nullptr}, two_of{"pareto", "?", nullptr};
    const std::string html = studies_html({{&one, first}, {&two_of, pareto}}, false);
    EXPECT_LT(html.find("pareto/speed.svg"), html.find("<ul>"));
    EXPECT_LT(html.find("what is seen"), html.find("<ul>"));
    EXPECT_GT(html.find("pareto/more.svg"), html.find("</ul>"));
    EXPECT_GT(html.find("tiny/other.svg"), html.find("</ul>"));
}

}  // namespace studies
