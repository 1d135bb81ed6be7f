#include "etalon/initialization/plugin_loader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

/** The folder that holds the test plugin `name` alone. */
std::string folder(const std::string& name) { return ETALON_TEST_INITIALIZERS "/" + name; }
std::string library(const std::string& name) { return folder(name) + "/" + name + ".so"; }

/** What create() throws as PluginError. */
std::string createError(PluginLoader loader, const std::string& name) {
  try {
    loader.create(name);
  } catch (const PluginError& e) {
    return e.what();
  }
  return "<nothing thrown>";
}

/** Both ways to a plugin must refuse it with the same reason: by path, and found in a folder. */
void expectRefused(const std::string& name, const ::testing::Matcher<std::string>& reason) {
  EXPECT_THAT(createError(PluginLoader({}), library(name)),
              AllOf(HasSubstr(library(name)), reason));
  PluginLoader loader({folder(name)});
  EXPECT_TRUE(loader.available().empty());
  ASSERT_EQ(loader.rejected().size(), 1U);
  EXPECT_EQ(loader.rejected()[0].path, library(name));
  EXPECT_THAT(loader.rejected()[0].reason, reason);
  EXPECT_THAT(createError(loader, name), reason);
}

/** A file in a folder of its own, removed afterwards. */
class PluginFile : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& content) {
    return folder_.write(name, content);
  }
  static std::string contentOf(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  testing::TemporaryFolder folder_;
};

TEST(PluginLoader, FindsCreatesAndConfiguresAPlugin) {
  PluginLoader loader({folder("good")});
  ASSERT_EQ(loader.available().size(), 1U);
  EXPECT_TRUE(loader.rejected().empty());
  const PluginInfo info = loader.info("good");
  EXPECT_EQ(info.name, "good");
  EXPECT_EQ(info.path, library("good"));
  EXPECT_EQ(info.version, "1.2");
  EXPECT_EQ(info.description, "does as it is told");
  EXPECT_EQ(info.class_name, "etalon::test_plugins::Good");
  const Initializer::Ptr one = loader.create("good");
  const Initializer::Ptr other = loader.create("good");
  EXPECT_NE(one, other);
  EXPECT_FALSE(one->needsVisualSolution());
  ParameterSet parameters("good");
  one->declareParameters(parameters);
  EXPECT_EQ(parameters.describe().size(), 2U);
}

TEST(PluginLoader, CatchesWhatAPluginThrowsAcrossTheLibraryBoundary) {
  PluginLoader loader({folder("good")});
  const Initializer::Ptr initializer = loader.create("good");
  ParameterSet parameters("good");
  initializer->declareParameters(parameters);
  parameters.read(IniFile::fromText("[good]\nanswer = data_error\n", "a.ini"));
  InitializationProblem::Data data;
  data.frames = {{0, {}, {}}, {5'000'000, {}, {}}};
  data.keyframe_indices = {0, 1};
  std::vector<ImuSample> samples(2);
  samples[1].t = 5'000'000;
  data.imu = ImuBuffer(samples);
  const auto result = initializer->initialize(InitializationProblem(data));
  EXPECT_EQ(result.error().status, RefusalStatus::kInvalidInput);  // that is, caught as DataError
  EXPECT_THAT(result.error().reason, HasSubstr("imu.csv:7"));
}

TEST(PluginLoader, TakesALibraryByPathAndAsPartOfTheSearchPath) {
  PluginLoader by_path({});
  EXPECT_NE(by_path.create(library("good")), nullptr);
  PluginLoader in_search_path({library("good")});
  EXPECT_NE(in_search_path.create("good"), nullptr);
}

TEST(PluginLoader, RefusesAMissingFile) {
  EXPECT_THAT(createError(PluginLoader({}), "/no/such/plugin.so"),
              AllOf(HasSubstr("/no/such/plugin.so"), HasSubstr("no such file")));
  PluginLoader loader({"/no/such/folder"});
  ASSERT_EQ(loader.rejected().size(), 1U);
  EXPECT_THAT(loader.rejected()[0].reason, HasSubstr("no such file or folder"));
  EXPECT_THAT(createError(PluginLoader({}), folder("good") + "/"), HasSubstr("not a regular file"));
}

TEST(PluginLoader, RefusesAnUnknownNameWithTheNearestAndTheSearchPath) {
  EXPECT_THAT(createError(PluginLoader({folder("good")}), "goood"),
              AllOf(HasSubstr("did you mean 'good'?"), HasSubstr("available: good"),
                    HasSubstr(folder("good"))));
  EXPECT_THAT(createError(PluginLoader({}), "good"), HasSubstr("available: none"));
}

TEST_F(PluginFile, RefusesTextEmptyAndTruncatedFiles) {
  EXPECT_THAT(createError(PluginLoader({}), write("text.so", "not a library\n")),
              HasSubstr("not a shared library"));
  EXPECT_THAT(createError(PluginLoader({}), write("empty.so", "")),
              HasSubstr("not a shared library"));
  const std::string whole = contentOf(library("good"));
  ASSERT_GT(whole.size(), 10000U);
  for (const size_t size : {size_t{16}, size_t{64}, size_t{200}, size_t{5000}, whole.size() / 2}) {
    const std::string path = write("cut_" + std::to_string(size) + ".so", whole.substr(0, size));
    EXPECT_THAT(createError(PluginLoader({}), path),
                ::testing::AnyOf(HasSubstr("truncated"), HasSubstr("not a shared library")))
        << size;
  }
  EXPECT_THAT(createError(PluginLoader({}), write("cut.so", whole.substr(0, whole.size() / 4))),
              HasSubstr("truncated"));
}

TEST_F(PluginFile, RefusesALibraryOfAnotherMachine) {
  std::string content = contentOf(library("good"));
  content[18] = '\x08';  // e_machine: MIPS
  EXPECT_THAT(createError(PluginLoader({}), write("mips.so", content)),
              HasSubstr("another machine"));
}

TEST(PluginLoader, RefusesAnotherAbiVersionWithoutReadingOn) {
  expectRefused("wrong_abi", AllOf(HasSubstr("version 999"),
                                   HasSubstr("version " + std::to_string(ETALON_INITIALIZER_ABI)),
                                   HasSubstr("rebuild")));
}

TEST(PluginLoader, RefusesAnInterfaceOfAnotherAbiVersionAsSuch) {
  expectRefused("older_interface",
                AllOf(HasSubstr("version 0 of the initializer ABI"), HasSubstr("rebuild")));
}

TEST(PluginLoader, RefusesAnUndefinedSymbolByItsReadableName) {
  expectRefused("undefined_symbol",
                HasSubstr("etalon::test_plugins::functionThatNobodyDefines(int)"));
}

TEST(PluginLoader, RefusesMissingNullAndIncompleteDescriptors) {
  expectRefused("no_descriptor", HasSubstr("etalon_initializer_descriptor"));
  expectRefused("null_descriptor", HasSubstr("null descriptor"));
  expectRefused("bad_name", HasSubstr("descriptor is incomplete"));
}

TEST(PluginLoader, RefusesClassesThatAreNotRegisteredOrNoInitializers) {
  expectRefused("unregistered", HasSubstr("not registered its class"));
  expectRefused("wrong_base", HasSubstr("does not derive from etalon::Initializer"));
  EXPECT_THAT(createError(PluginLoader({folder("lying_base")}), "lying_base"),
              HasSubstr("does not derive from etalon::Initializer, although it says so"));
}

TEST(PluginLoader, ReportsAConstructorThatThrows) {
  EXPECT_THAT(createError(PluginLoader({folder("throws_when_made")}), "throws_when_made"),
              HasSubstr("no licence found"));
}

TEST(PluginLoader, UsesTheFirstOfTwoPluginsWithOneName) {
  PluginLoader loader({folder("good"), folder("same_name")});
  ASSERT_EQ(loader.available().size(), 1U);
  ASSERT_EQ(loader.rejected().size(), 1U);
  EXPECT_EQ(loader.rejected()[0].path, library("same_name"));
  EXPECT_THAT(loader.rejected()[0].reason,
              AllOf(HasSubstr("name 'good'"), HasSubstr(library("good"))));
  EXPECT_EQ(loader.info("good").version, "1.2");
  EXPECT_NE(loader.create("good"), nullptr);

  PluginLoader other_order({folder("same_name"), folder("good")});
  EXPECT_EQ(other_order.info("good").version, "9.9");
}

TEST(PluginLoader, RefusesAClassNameThatIsTaken) {
  PluginLoader loader({folder("good"), folder("same_class")});
  ASSERT_EQ(loader.rejected().size(), 1U);
  EXPECT_THAT(loader.rejected()[0].reason, AllOf(HasSubstr("etalon::test_plugins::Good"),
                                                 HasSubstr("rename"), HasSubstr(library("good"))));
  EXPECT_NE(loader.create("good"), nullptr);  // the first is still usable
}

TEST_F(PluginFile, SeesAFileOnceHoweverItIsReached) {
  fs::create_symlink(library("good"), folder_ / "link.so");
  PluginLoader loader(
      {folder("good"), library("good"), folder("good") + "/../good", folder_.path()});
  EXPECT_EQ(loader.available().size(), 1U);
  EXPECT_TRUE(loader.rejected().empty());
}

TEST_F(PluginFile, OneBrokenFileDoesNotSpoilTheFolder) {
  write("a_text.so", "text");
  write("readme.txt", "ignored");
  fs::copy_file(library("wrong_abi"), folder_ / "b_wrong_abi.so");
  fs::create_symlink(library("good"), folder_ / "c_good.so");
  PluginLoader loader({folder_.path()});
  EXPECT_EQ(loader.available().size(), 1U);
  EXPECT_EQ(loader.rejected().size(), 2U);
}

TEST(PluginLoader, PutsExplicitPathsBeforeTheDefaultOnes) {
  const auto path = PluginLoader::defaultSearchPath({"/first", "second"});
  ASSERT_GE(path.size(), 2U);
  EXPECT_EQ(path[0], "/first");
  EXPECT_EQ(path[1], "second");
  for (size_t i = 2; i < path.size(); ++i) EXPECT_TRUE(fs::is_directory(path[i])) << path[i];
}

}  // namespace
}  // namespace etalon
