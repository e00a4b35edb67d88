#include "formats/text/newick.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::ThrowsMessage;

std::vector<TreeNode> tree_of(const std::string& text) { return parse_newick("t.nwk", text); }

std::vector<std::string> words_of(const std::vector<TreeNode>& tree) {
  std::vector<std::string> words;
  for (const TreeNode& node : tree)
    words.push_back(node.name + " " + std::to_string(node.parent) + " " + std::to_string(node.length).substr(0, 4));
  return words;
}

TEST(Newick, ListsParentsBeforeTheirChildren) {
  EXPECT_THAT(words_of(tree_of("(a:1,(b:2,c:.5)d:3e0)r;")),
              ElementsAre("r -1 0.00", "a 0 1.00", "d 0 3.00", "b 2 2.00", "c 2 0.50"));
}

TEST(Newick, ReadsLabelsAsProgramsWriteThem) {
  EXPECT_THAT(words_of(tree_of(" ( 'it''s (a)' : 1 [a comment],\n Homo_sapiens:2 ) [&R] :0.0 ;\n")),
              ElementsAre(" -1 0.00", "it's (a) 0 1.00", "Homo_sapiens 0 2.00"));
  EXPECT_THAT(words_of(tree_of("((a,b),c)")), ElementsAre(" -1 0.00", " 0 1.00", "a 1 1.00", "b 1 1.00", "c 0 1.00"));
}

TEST(Newick, SaysWhereItIsNoTree) {
  for (const auto& [text, message] : std::vector<std::pair<std::string, std::string>>{
           {"((a,b);", "t.nwk:1: 1 '(' without ')'"},
           {"(a,b));", "t.nwk:1: ')' without '('"},
           {"a;", "t.nwk:1: the tree has no branch"},
           {"x,y\n0,0\n", "t.nwk:1: ',' outside of all parentheses: it is no Newick tree"},
           {"(a,b);\n(c,d);", "t.nwk:2: there is more than one tree; one is needed"},
           {"(a:1,\nb:x);", "t.nwk:2: the length of a branch is 'x'; a number that is not negative is needed"},
           {"(a:1,b:-1);", "t.nwk:1: the length of a branch is '-1'; a number that is not negative is needed"},
           {"(a:1,b);", "t.nwk:1: 1 of 2 branches have a length; all or none are needed"},
           {"(a,a);", "t.nwk:1: two nodes are called 'a'"},
           {"('a,b);", "t.nwk:1: a label has no closing quote"},
           {"(a[,b);", "t.nwk:1: '[' without ']'"},
           {"(a'b',c);", "t.nwk:1: ''' where ',', ')' or ';' is expected"}})
    EXPECT_THAT([&] { tree_of(text); }, ThrowsMessage<InputError>(message)) << text;
}

}  // namespace
}  // namespace pulson::formats
