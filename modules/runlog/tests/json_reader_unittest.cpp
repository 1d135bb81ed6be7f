#include "etalon/runlog/json_reader.h"

#include <gtest/gtest.h>

#include <cmath>

namespace etalon {
namespace {

using Json = nlohmann::json;

/** The message that reading a document throws; empty if none. */
template <typename Action>
std::string errorOf(const Json& json, const Action& action) {
  try {
    action(JsonReader(json, "run.json"));
  } catch (const DataError& e) {
    return e.what();
  }
  return "";
}

TEST(JsonReader, ReadsEveryKindOfValue) {
  const Json json = Json::parse(
      R"({"text": "a", "yes": true, "x": 0.5, "nothing": null, "n": 3, "t": 1403636584763555584,
          "p": [1, 2, 3], "list": [{"k": 1}, {"k": 2}]})");
  const JsonReader reader(json, "run.json");
  EXPECT_TRUE(reader.has("x"));
  EXPECT_FALSE(reader.has("y"));
  EXPECT_EQ(reader.at("text").text(), "a");
  EXPECT_TRUE(reader.at("yes").boolean());
  EXPECT_EQ(reader.at("x").number(), 0.5);
  EXPECT_EQ(reader.at("n").number(), 3.0);
  EXPECT_TRUE(std::isnan(reader.at("nothing").number()));
  EXPECT_EQ(reader.at("n").count(), 3);
  EXPECT_EQ(reader.at("t").stamp(), 1403636584763555584);  // a double would lose the last digits
  EXPECT_EQ(reader.at("p").vector<3>(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(reader.at("list").elements().at(1).at("k").count(), 2);
  EXPECT_EQ(reader.at("list").elements().at(1).keys(), std::vector<std::string>{"k"});
}

TEST(JsonReader, NamesTheDocumentThePlaceAndWhatWasExpected) {
  const Json json = Json::parse(R"({"attempts": [{"t": 1}, {"t": "late", "v": [1, 2]}]})");
  const auto second = [](const JsonReader& reader) { return reader.at("attempts").elements()[1]; };
  EXPECT_EQ(errorOf(json, [&](const JsonReader& r) { second(r).at("t").stamp(); }),
            "run.json: in the JSON at '/attempts/1/t': expected an integer");
  EXPECT_EQ(errorOf(json, [&](const JsonReader& r) { second(r).at("status"); }),
            "run.json: in the JSON at '/attempts/1': expected an object with the key 'status'");
  EXPECT_EQ(errorOf(json, [&](const JsonReader& r) { second(r).at("v").vector<3>(); }),
            "run.json: in the JSON at '/attempts/1/v': expected 3 numbers");
  EXPECT_EQ(errorOf(json, [](const JsonReader& r) { r.elements(); }),
            "run.json: in the JSON at '/': expected an array");
}

TEST(JsonReader, RefusesOtherTypesAndValuesOutOfRange) {
  const auto error = [](const char* text, const auto& action) {
    return errorOf(Json::parse(text), action);
  };
  const auto text = [](const JsonReader& r) { r.text(); };
  const auto boolean = [](const JsonReader& r) { r.boolean(); };
  const auto number = [](const JsonReader& r) { r.number(); };
  const auto count = [](const JsonReader& r) { r.count(); };
  const auto stamp = [](const JsonReader& r) { r.stamp(); };
  const auto keys = [](const JsonReader& r) { r.keys(); };
  EXPECT_NE(error("1", text), "");
  EXPECT_NE(error("1", boolean), "");
  EXPECT_NE(error("\"1\"", number), "");
  EXPECT_NE(error("[]", keys), "");
  EXPECT_NE(error("1.5", count), "");
  EXPECT_NE(error("-1", count), "");
  EXPECT_EQ(error("2147483647", count), "");
  EXPECT_NE(error("2147483648", count), "");
  EXPECT_EQ(error("0", stamp), "");
  EXPECT_NE(error("-1", stamp), "");
  EXPECT_NE(error("4000000000000000001", stamp), "");
  EXPECT_NE(error("18446744073709551615", stamp), "");  // no TimeNs
  const auto integer = [](const JsonReader& r) { r.integer(); };
  EXPECT_EQ(error("9223372036854775807", integer), "");
  EXPECT_EQ(error("-9223372036854775808", integer), "");
  EXPECT_NE(error("9223372036854775808", integer), "");
  EXPECT_NE(error("18446744073709551616", integer), "");
}

}  // namespace
}  // namespace etalon
