# Each function gives what the program gives of the same numbers in other files, to the last digit.
source("helpers.R")

folder <- tempfile("program")
dir.create(folder)
at <- function(...) file.path(folder, ...)
keys <- function(a, b, names) for (name in names) same(a[[name]], b[[name]], name)

# ---- register and warp, with names and a missing landmark
source <- leaves[, , 1]
target <- leaves[, , 2]
rownames(source) <- rownames(target) <- paste("point", seq_len(nrow(source)))
target[5, ] <- NA
utils::write.csv(write_csv(source), at("a.csv"), row.names = FALSE)
utils::write.csv(write_csv(target), at("b.csv"), row.names = FALSE)
fit <- quietly(pulson_register(source, target, noise = "ch-sd:beta=2%"))
stopifnot(program("register", at("a.csv"), at("b.csv"), "--noise", "ch-sd:beta=2%", "-o", at("fit"),
                  "--no-picture")$code == 0)
plain <- record(at("fit", "registration.json"))
keys(fit$record, plain, c("momenta", "result", "rms", "kernel", "lambda", "sigma", "target", "increments", "matched"))
same(fit$cost, unlist(plain$cost))
same(fit$momenta, plain$momenta)
stopifnot(inherits(fit, "pulson_registration"), identical(rownames(fit$momenta), rownames(source)),
          nrow(as.data.frame(fit)) == 19)
same(as.data.frame(fit)$distance, column(at("fit", "residuals.csv"), "distance"))
grid <- as.matrix(expand.grid(x = c(0.1, 200, 300), y = c(50, 1 / 3)))
utils::write.csv(write_csv(grid), at("grid.csv"), row.names = FALSE)
moved <- pulson_warp(fit, grid)
stopifnot(program("warp", at("fit", "registration.json"), at("grid.csv"), "-o", at("moved.csv"))$code == 0,
          identical(dimnames(moved), dimnames(grid)))
same(moved, c(column(at("moved.csv"), "x"), column(at("moved.csv"), "y")))
saved <- tempfile()
saveRDS(fit, saved)
same(pulson_warp(readRDS(saved), grid), moved)
three <- array(c(grid, grid + 1), c(6, 2, 2), list(NULL, c("x", "y"), c("p", "q")))
same(quietly(pulson_warp(fit, three))[, , "p"], moved)
cohort <- quietly(pulson_register(leaves[, , 1], leaves[, , 2:3], kernel = "gaussian:alpha=100", lambda = 1e-4))
stopifnot(inherits(cohort, "pulson_cohort"), identical(as.data.frame(cohort)$specimen, c("leaf_2", "leaf_3")))
one <- quietly(pulson_register(leaves[, , 1], leaves[, , 3], kernel = "gaussian:alpha=100", lambda = 1e-4))
same(cohort$registrations$leaf_3$momenta, one$momenta)

# Landmarks that are left out keep their rows.
gone <- leaves[, , 1]
gone[6, ] <- NaN
left <- quietly(pulson_register(gone, leaves[, , 2]))
rest <- quietly(pulson_register(gone[-6, ], leaves[-6, , 2]))
for (name in c("source", "aligned", "target", "result", "momenta")) {
  stopifnot(identical(dim(left[[name]]), c(19L, 2L)), all(is.na(left[[name]][6, ])))
  same(left[[name]][-6, ], rest[[name]], name)
}
stopifnot(identical(rownames(as.data.frame(left))[6], "7"), any(grepl("left out 1 landmark", capture.output(left))))
named <- leaves[, , 1]
rownames(named) <- paste0("p", 1:19)
left <- quietly(pulson_register(named, named[3:14, ]))
stopifnot(identical(rownames(left$result), rownames(named)), which(!is.na(left$result[, 1])) == 3:14)
two <- quietly(pulson_register(gone, leaves[, , 2:3]))
stopifnot(nrow(two$registrations[[2]]$result) == 19,
          nrow(quietly(pulson_register(leaves[, , 1], leaves[, , 2], landmarks = c(2, 1, 5:9)))$result) == 7)

# ---- atlas with a formula
size <- centroid_size(leaves)
form <- rep(c("long, thin", "wide"), 4)
called <- quietly(pulson_atlas(coords ~ log(size) + form, list(coords = leaves, size = size, form = factor(form)),
                               permutations = 99))
invisible(write_cohort(leaves, at("leaves.csv")))
utils::write.csv(data.frame(specimen = dimnames(leaves)[[3]], size = sprintf("%.17g", size), form = form),
                 at("data.csv"), row.names = FALSE)
stopifnot(program("atlas", at("leaves.csv"), "-o", at("atlas"), "--no-picture", "--permutations", "99", "--model",
                  "log(size) + form", "--data", at("data.csv"))$code == 0)
plain <- record(at("atlas", "atlas.json"))
keys(called$record, plain, c("template", "kernel", "lambda", "sigma"))
same(called$modes$scores, plain$modes$scores)
same(called$procrustes$scores, plain$procrustes$scores)
table <- utils::read.csv(at("atlas", "model.csv"))
stopifnot(identical(called$anova$term, table$term), identical(called$anova$model, table$model),
          all.equal(called$anova$procrustes_ss, table$procrustes_ss, tolerance = 1e-12),
          identical(called$anova$p_value, table$p_value), called$pairs$first == "long, thin",
          unique(called$coefficients$coefficient) == c("log(size)", "formwide"))
# Sums of squares are those of R's own least squares.
plain_anova <- c(sum(called$procrustes$scores^2), sapply(list(~ log(size), ~ log(size) + form), function(f)
  sum(stats::lm.fit(stats::model.matrix(f), called$procrustes$scores)$residuals^2)))
stopifnot(all.equal(called$anova$procrustes_ss[1:2], -diff(plain_anova)))
third <- utils::read.csv(at("atlas", "momenta.csv"))$specimen == "leaf_3"
same(called$momenta[, "X", "leaf_3"], column(at("atlas", "momenta.csv"), "px")[third])
same(called$momenta[, "Y", "leaf_3"], column(at("atlas", "momenta.csv"), "py")[third])
alone <- quietly(pulson_atlas(leaves ~ log(size), permutations = 9))
grouped <- quietly(pulson_atlas(leaves ~ form, permutations = 9))
crossed <- quietly(pulson_atlas(leaves ~ size * form, permutations = 9))
stopifnot(identical(rownames(called$modes$scores), dimnames(leaves)[[3]]), alone$regression$covariate == "log(size)",
          grouped$groups$term == "form", identical(called$group, form), identical(alone$anova$term[1], "log(size)"),
          identical(crossed$anova$term[1:3], c("size", "form", "size:form")),
          ncol(as.data.frame(called)) == ncol(called$specimens) + ncol(called$modes$scores))
fails(pulson_atlas(leaves ~ size + I(2 * size)), "pulson_input_error", "combination of the terms before it")
fails(pulson_atlas(leaves ~ size + offset(size)), "pulson_input_error", "offset")
fails(pulson_atlas(leaves ~ size - 1), "pulson_input_error", "intercept")
fails(pulson_atlas(~ size), "pulson_input_error", "shape ~ log(size)")
fails(pulson_atlas(leaves ~ size[1:3]), "pulson_input_error", "3 values for 8 specimens")
fails(pulson_atlas(leaves ~ nothing), "pulson_input_error", "'nothing' not found")
fails(pulson_atlas(leaves, list(size = size)), "pulson_input_error", "it is for a formula")
# A mode is what the atlas shoots: its ends are those of the program's picture, a standard deviation that of the scores.
ends <- pulson_mode(called, 1, 1)
norm <- sum((ends - called$template)^2)
stopifnot(all.equal(stats::var(called$modes$scores[, 1]), called$modes$eigenvalues[1]), norm > 0,
          max(abs(pulson_mode(called, 1, 0) - called$template)) < 1e-9)
# A vector with a value for each specimen is a column of a table, and its tests are printed.
column_csv <- paste0(at("data.csv"), ":form")
given <- quietly(pulson_atlas(leaves, groups = factor(form), permutations = 9))
named <- quietly(pulson_atlas(leaves, groups = setNames(rev(form), rev(dimnames(leaves)[[3]])), permutations = 9))
filed <- quietly(pulson_atlas(leaves, groups = column_csv, permutations = 9))
for (one in list(given, named, filed)) {
  stopifnot(identical(one$group, form), identical(one$anova$p_value, grouped$anova$p_value))
  shown <- capture.output(print(one))
  stopifnot(any(grepl("8 specimens, 9 permutations", shown)), any(grepl("momenta R2 +F +Z +p", shown)))
}
both <- quietly(pulson_atlas(leaves, groups = form, covariate = size, permutations = 9))
stopifnot(both$anova$model == rep(c("covariate", "groups"), each = 3))
stopifnot(nrow(quietly(pulson_audit(leaves, repeats = rep(1:4, 2)))$findings) >= 0)
array_of_one <- tapply(size, names(size), mean)
same(quietly(pulson_atlas(leaves ~ array_of_one, permutations = 9))$anova$f,
     quietly(pulson_atlas(leaves ~ size, permutations = 9))$anova$f)
factored <- quietly(pulson_atlas(leaves ~ factor(rep(1:2, 4)), permutations = 9))
shown <- factored$printed[grep("R\u00b2|factor|residuals", factored$printed)]
stopifnot(!any(grepl("factor(factor", factored$printed, fixed = TRUE)), length(shown) == 4,
          regexpr("1 ", shown[3])[1] > 0, regexpr(" 1  ", shown[3])[1] == regexpr(" 6  ", shown[4])[1])
broken <- leaves
broken[4, , 6] <- NA
filled <- quietly(pulson_atlas(broken))
stopifnot(filled$predicted$specimen == "leaf_6", !anyNA(filled$complete))
same(filled$complete[-4, , ], leaves[-4, , ])

# ---- compare, audit, sample
models <- c("none", "trouve-vialard:sigma=20")
called <- quietly(pulson_compare(leaves[, , 1:2], noise = models, sigma = 0.5, kernel = "gaussian:alpha=100",
                                 lambda = 0.001, seed = 3))
invisible(write_cohort(leaves[, , 1:2], at("two.csv")))
stopifnot(program("compare", at("two.csv"), "-o", at("compare"), "--no-picture", "--noise", models[1], "--noise",
                  models[2], "--sigma", "0.5", "--kernel", "gaussian:alpha=100", "--lambda", "0.001", "--seed",
                  "3")$code == 0)
same(called$models$log_evidence, column(at("compare", "models.csv"), "log_evidence"))
same(called$best, record(at("compare", "comparison.json"))$best)
# What is printed is the score and its differences, as the program does.
shown <- capture.output(print(called))
best <- which.max(called$models$score)
stopifnot(all.equal(called$models$difference, called$models$score - max(called$models$score)), any(grepl("score", shown)),
          !any(grepl("log_evidence", shown)), any(grepl(called$verdict[1], paste(trimws(shown), collapse = " "), fixed = TRUE)),
          identical(rownames(as.data.frame(called)), c("1", "2")), identical(rownames(called$numbers),
          as.character(seq_len(nrow(called$numbers)))), is.logical(called$models$converged),
          is.logical(called$shapes$converged), is.null(called$shapes$shape))
fitted <- quietly(pulson_compare(leaves[, , 1], leaves[, , 2], noise = c("none", "ch-sd:beta=fit"), sigma = 0.5,
                                kernel = "gaussian:alpha=100", lambda = 0.001))
stopifnot(nrow(fitted$models) == 2, fitted$numbers$number == "beta", is.logical(fitted$numbers$vanishes),
          rownames(fitted$models) == 1:2)
wrong <- leaves
wrong[c(3, 12), , 5] <- wrong[c(12, 3), , 5]
called <- quietly(pulson_audit(wrong, fix = TRUE))
invisible(write_cohort(wrong, at("wrong.csv")))
stopifnot(program("audit", at("wrong.csv"), "-o", at("audit"), "--no-picture")$code == 0)
same(called$findings$log_ratio, column(at("audit", "audit.csv"), "log_ratio"))
stopifnot(called$findings$kind == "exchanged", called$findings$specimen == "leaf_5",
          identical(called$findings$mended, TRUE))
same(called$mended, leaves)
stopifnot(nrow(quietly(pulson_audit(leaves))$findings) == 0)
pair <- list(matrix(c(0, 1), 2), matrix(c(0.1, 1.2), 2))
options <- list(noise = "ch-sd:beta=0.3", sigma = 0.1, lambda = 1, kernel = "gaussian:alpha=0.5", warmup = 50, draws = 50,
                chains = 2)
called <- quietly(do.call(pulson_sample, c(pair, options)))
utils::write.csv(write_csv(pair[[1]]), at("p.csv"), row.names = FALSE)
utils::write.csv(write_csv(pair[[2]]), at("q.csv"), row.names = FALSE)
words <- unlist(Map(function(name, value) c(paste0("--", name), value), names(options), options))
plain <- program("sample", at("p.csv"), at("q.csv"), "-o", at("sample"), words, "--no-picture")
stopifnot(plain$code %in% c(0, 3))
for (name in names(called$draws)) same(called$draws[[name]], column(at("sample", "draws.csv"), name), name)
stopifnot(length(dim(called$momenta)) >= 3, nrow(called$parameters) > 0)

# ---- what is printed and drawn
grDevices::pdf(tempfile(fileext = ".pdf"))
for (one in list(fit, cohort, filled, called, quietly(pulson_audit(wrong)))) {
  stopifnot(length(utils::capture.output(print(one))) > 0, length(utils::capture.output(print(summary(one)))) > 0)
  plot(one)
}
plot(filled, "mode")
plot(filled, modes = 2)
plot(given)
plot(fitted)
# A cohort is drawn over its source, with the alignments undone; on a line, a row for each.
undone <- pulson:::in_frame_of_source(cohort$registrations$leaf_3)
stopifnot(sqrt(mean((undone - leaves[, , 1])^2)) < 30)
line <- array(c(0, 1, 3, 0, 1.2, 3.1, 0.1, 1, 3.3), c(3, 1, 3))
plot(quietly(pulson_register(line[, , 1], line)))
invisible(grDevices::dev.off())
