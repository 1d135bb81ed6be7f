#include "etalon/core/folder_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;

TEST(FolderLock, HoldsTheFolderAsLongAsItLives) {
  const testing::TemporaryFolder folder;
  auto lock = std::make_unique<FolderLock>(folder.path());
  // The lock belongs to the open file: a second one is refused in the same process as well.
  try {
    const FolderLock second(folder.path());
    FAIL() << "two locks of one folder";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("another etalon is writing into '" + folder.path() + "'"));
  }
  lock.reset();
  EXPECT_NO_THROW(FolderLock(folder.path()));
}

TEST(FolderLock, AFolderThatIsNotThereIsADataError) {
  const testing::TemporaryFolder folder;
  try {
    const FolderLock lock((folder / "nowhere").string());
    FAIL() << "a lock of nothing";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("nowhere/.lock"));
    EXPECT_THAT(e.what(), HasSubstr("cannot be written"));
  }
}

}  // namespace
}  // namespace etalon
