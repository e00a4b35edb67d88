# Whatever holds landmarks in R goes to the program and comes back, to the last digit.
source("helpers.R")

there_and_back <- function(shapes) {
  path <- tempfile(fileext = ".json")
  quietly(pulson_write(shapes, path))
  quietly(pulson_read(path))
}

set.seed(3)
for (k in 1:3) for (n in c(1, 4)) {
  shapes <- array(rnorm(7 * k * n) * 10^sample(-12:12, 7 * k * n, replace = TRUE), c(7, k, n),
                  list(paste("point", 1:7), NULL, c("Blatt \u00e4", "b c", "\"c\", d", "\u8449")[seq_len(n)]))
  shapes[2, , n] <- NA
  back <- there_and_back(shapes)
  same(back, shapes)
  stopifnot(identical(dim(back), dim(shapes)), identical(dimnames(back)[c(1, 3)], dimnames(shapes)[c(1, 3)]))
}
same(there_and_back(leaves[, , 1]), leaves[, , 1])
same(there_and_back(list(shape = leaves)), leaves)
same(there_and_back(list(coords = leaves, Csize = 1)), leaves)
same(there_and_back(as.data.frame(leaves[, , 2])), leaves[, , 2])
whole <- array(1:24, c(4, 2, 3))
same(there_and_back(whole), as.numeric(whole))
stopifnot(identical(dimnames(there_and_back(whole))[[3]], c("1", "2", "3")))
complex <- apply(leaves[, , 1:2], 3, function(one) complex(real = one[, 1], imaginary = one[, 2]))
same(there_and_back(complex), leaves[, , 1:2])
uneven <- list(one = leaves[1:5, , 1], two = leaves[, , 2])
back <- there_and_back(uneven)
stopifnot(identical(names(back), c("one", "two")))
same(back$one, uneven$one)

# Numbers of rows are no names of landmarks; parts of a table, and a whole one, are shapes.
table <- data.frame(specimen = rep(dimnames(leaves)[[3]], each = 19), landmark = 1:19, x = as.vector(leaves[, 1, ]),
                    y = as.vector(leaves[, 2, ]))
part <- function(i) table[table$specimen == dimnames(leaves)[[3]][i], c("x", "y")]
plain <- quietly(pulson_register(leaves[, , 1], leaves[, , 2]))
for (as in list(identity, as.matrix))
  same(quietly(pulson_register(as(part(1)), as(part(2))))$momenta, plain$momenta)
numbered <- leaves
rownames(numbered) <- 3:21
same(quietly(pulson_register(numbered[, , 1], leaves[, , 2]))$momenta, plain$momenta)
parts <- split(table[c("x", "y")], table$specimen)
same(there_and_back(parts), leaves)
same(there_and_back(lapply(parts, as.matrix)), leaves)
stopifnot(identical(names(quietly(pulson_warp(plain, parts))), names(parts)))
same(there_and_back(table), leaves)
stopifnot(identical(names(centroid_size(table)), dimnames(leaves)[[3]]))
same(quietly(pulson_register(table[1:19, ], table[20:38, ]))$momenta, plain$momenta)
fails(pulson_atlas(setNames(table, c("specimen", "lm", "c1", "c2"))), "pulson_input_error", "columns x, y and z")
fails(pulson_atlas(data.frame(specimen = 1:4, lm = 1, u = 1, v = 1)), "pulson_input_error", "columns x, y and z")
same(there_and_back(array(c(0, 1, 3), 3)), c(0, 1, 3))

# Another program's reader sees the same.
path <- tempfile(fileext = ".csv")
quietly(pulson_write(leaves[, , 1], path))
same(c(column(path, "x"), column(path, "y")), leaves[, , 1])
stopifnot(all.equal(unname(centroid_size(leaves)[1]),
                    sqrt(sum(scale(leaves[, , 1], scale = FALSE)^2))), names(centroid_size(leaves))[2] == "leaf_2")

fails(pulson_register(t(leaves[, , 1]), leaves[, , 2]), "pulson_input_error", "source: it is 2 x 19", "t(source)")
fails(pulson_atlas(aperm(leaves, c(3, 1, 2))), "pulson_input_error", "axes last", "aperm(shapes, c(2, 3, 1))")
fails(pulson_atlas(aperm(leaves, c(2, 1, 3))), "pulson_input_error", "axes first", "aperm(shapes, c(2, 1, 3))")
fails(pulson_atlas(matrix(0, 8, 38)), "pulson_input_error", "geomorph::arrayspecs(shapes, 19, 2)")
fails(pulson_atlas(leaves[, , 1]), "pulson_input_error", "one specimen")
fails(pulson_atlas(leaves[, , 0]), "pulson_input_error", "it is empty")
fails(pulson_atlas(list(size = 1)), "pulson_input_error", "holds no landmarks")
fails(pulson_atlas(factor("a")), "pulson_input_error", "class factor")
fails(pulson_atlas(data.frame(name = "a", u = 1)), "pulson_input_error", "'name' is no number")
fails(pulson_register(leaves[, , 1] / 0, leaves[, , 2]), "pulson_input_error", "infinite")
fails(pulson_register("nowhere.tps", leaves[, , 2]), "pulson_input_error", "there is no file 'nowhere.tps'")
fails(pulson_register(array(0, c(2, 2, 2, 2)), leaves[, , 2]), "pulson_input_error", "4 dimensions")
