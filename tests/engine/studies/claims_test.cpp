#include "engine/studies/claims.h"

#include <cmath>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "engine/studies/study_files.h"

namespace studies {
namespace {

const std::vector<Claim> two = {{"Fig. 1: \"half\" [%]", 50.0, 49.5, true, "of 200"},
                                {"Fig. 2: best", std::string("10 to 20"), std::nan(""), false}};

}  // namespace

TEST(Claims, AsJsonKeepNumbersWordsAndWhatWasNotToBeHad) {
    const auto json = nlohmann::json::parse(claims_json(two));
    ASSERT_EQ(json.size(), 2u);
    EXPECT_EQ(json[0]["text"], "Fig. 1: \"half\" [%]");
    EXPECT_EQ(json[0]["published"], 50.0);
    EXPECT_EQ(json[0]["measured"], 49.5);
    EXPECT_EQ(json[0]["holds"], true);
    EXPECT_EQ(json[0]["note"], "of 200");
    EXPECT_EQ(json[1]["published"], "10 to 20");
    EXPECT_TRUE(json[1]["measured"].is_null());
    EXPECT_EQ(json[1]["holds"], false);
}

TEST(Claims, OfAllStudiesStandOnOnePageWithThePictures) {
    StudyResult result;
    result.claims = two;
    result.plots = {{"picture", "", 900, 600, "a < b"}};
    result.tables = {{"numbers", {"x"}, {}}};
    const Study study{"tiny", "Is a < b?", nullptr};
    const std::string html = studies_html({{&study, result}}, true);
    for (const char* part :
         {"study all --quick", "src=\"tiny/picture.svg\"", "a &lt; b", "Is a &lt; b?", "&quot;half&quot;",
          "<td class=\"no\">no</td>", "<td>–</td>", "tiny/numbers.csv"})
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
