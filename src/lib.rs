//! `mocban` aligns 3D scans of carved woodblock characters with images of their prints.
//!
//! # Code map
//!
//! A **pair** is one character: a mesh of the carved block and an image of its print. Its **job** runs four **stages**:
//! `fit`, `depth`, `normalize` and `register`. A **worker** is one process that runs stages. It leases a pair and runs
//! the remaining stages. While a stage is computed, the worker writes a **checkpoint** of the stage before: first the
//! files, then the rows in a transaction, which may hold the checkpoints of several pairs and may wait for them up to
//! 250 ms. The stage is durable when this transaction is committed. Stages are pure functions. Only the catalog
//! contains SQL, only the store handles artifact files, and the runner connects both with the stages.
//!
//! ## One pair, from manifest row to report cell
//!
//! Read these files in order to follow a pair through the program:
//!
//! 1. `crates/lists/src/manifest/csv.rs`: parses the rows of a manifest
//! 2. `crates/catalog/src/records/import.rs`: stores pairs and their jobs in one transaction
//! 3. `crates/runner/src/run.rs`: starts a run: takes the lock, registers this process as a worker, recovers jobs of dead
//!    workers, stores which inputs changed, requeues stale pairs, ends back-offs that are due
//! 4. `crates/runner/src/scheduler.rs`: the main loop, which starts a task for each leased pair
//! 5. `crates/runner/src/prefetch.rs`: leases pairs for free slots, and a few more in advance
//! 6. `crates/catalog/src/queue/claim.rs`: leases as many jobs as were asked for in one statement, each with a new fencing
//!    token; claims, heartbeats and releases are called through `api.rs` beside it
//! 7. `crates/runner/src/pair_task.rs`: waits for the thread of one leased pair, stores its failure
//! 8. `crates/runner/src/compute_thread.rs`: runs the stages of the pair one after another on a thread
//! 9. `crates/runner/src/stage_executor.rs`: reads the inputs of a stage, runs it and encodes its result
//! 10. `crates/align/src/stages/pipeline.rs`: chooses the method of `fit`, `normalize` and `register`; `depth` has only one. The
//!     stages start in `fit/upper_surface.rs` (plane, curvature, carved side), `depth.rs` (depth map),
//!     `normalize/mod.rs` (ink of the print, heights of tops and ground) and `register/mod.rs` (pose, thresholds,
//!     stroke maps, scores, confidence)
//! 11. `crates/runner/src/checkpointer.rs`: stores finished stages while the next one is computed
//! 12. `crates/store/src/artifacts.rs`: writes artifact files by content hash
//! 13. `crates/catalog/src/queue/commit/group_commit.rs`: stores up to 256 requests that wait for the writer task of this
//!     process in one transaction; all other writes, such as import, registration and recovery, have their own; several
//!     processes take turns by SQLite's lock (`busy_retry.rs`)
//! 14. `crates/catalog/src/queue/checkpoint.rs` (`server_checkpoint.rs` for PostgreSQL): the statements that record a
//!     finished stage and renew or end the lease
//! 15. `crates/catalog/src/records/pair_results.rs`: reads results back, with the verdicts of `verdicts.rs` beside it; the
//!     scores come from `stage_result.outcome`, the hash that verdicts refer to from `metric_result`
//! 16. `crates/report/src/build.rs`: iterates over all pairs
//! 17. `crates/report/src/accumulate.rs`: sums results per metric; Acc counts the passes of `consensus.rs`, and
//!     `truth_evaluation.rs` compares results with ground truth, if there is any
//! 18. `crates/report/src/render/report_tables.rs`: defines the columns of text, Markdown, LaTeX and HTML, together with
//!     `comparison_tables.rs` and `risk_coverage_tables.rs`; `csv.rs` has its own columns, and JSON is the serialized
//!     `Report`
//!
//! Smaller files on the way: `cli/import.rs` and `cli/manifest_file.rs` (the command that imports), `manifest/draft.rs`
//! (checks the values of a row), `cli/run.rs` (the command that runs), `runner/pair_context.rs` (the data of a pair
//! between its stages), `stage_inputs.rs` and `stage_output.rs` beside the executor, `queue/commit/writer.rs` (the task that
//! owns the write connection), `queue/commit/batch_collector.rs` (collects the requests of a commit),
//! `records/stage_results.rs` (the SQL that reads results), `catalog/new_catalog.rs` (a new project is durable when its catalog gets its name),
//! `runner/run_metrics.rs` (counts and times, which heartbeats store for `status --hosts`),
//! `records/pair_work.rs` (attributes and earlier results of leased pairs), `records/checksums.rs` (checksums of the
//! rows that no run can compute again), `cli/report.rs`, `report/headline.rs` (the answer in three
//! sentences), `report/provenance.rs` (settings and hashes), `report/render/table.rs` and `report/number_format.rs` (the
//! text of a cell).
//! `crates/system/src/failpoint.rs` lists the points of this path at which tests kill the process.
//!
//! ## Whole blocks
//!
//! A whole **block** is the scan of a carved face with the image of its page. Its job has the stages `face`, `align`,
//! `boxes` and `cut`. It is one of two kinds of job: the queue is written once for both, with statements in which the names
//! of a kind are filled in (`catalog/queue/kind.rs`); `queue/pair_job.rs` and `blocks/block_job.rs` have these names and
//! what a kind stores besides, and `blocks/queue.rs` the operations on blocks. A process works on one block at a time, and on
//! pairs only while it has no block: `block_slot.rs` in `runner` leases it, `block_task.rs` reads the versions of its
//! files and computes a stage on a thread, and `block_checkpoint.rs` stores the result before the next stage begins.
//! `run_selection.rs` selects the blocks and pairs of a run that names some. The
//! stages are called through the trait in `block_stages.rs`. `catalog/blocks/cut.rs` stores the last stage and its pairs in
//! one transaction: it adds new pairs, sends changed ones back to the first stage, and retires those whose boxes are gone.
//! A retired pair has no row in `job`, only one in `retired_pair` (`catalog/queue/retired.rs`), so that no other statement
//! has to leave it out. `catalog/blocks/staleness.rs` compares what each result was made with (settings, hashes of the
//! files, attributes) with the present, for the start of a run and for `--dry-run`.
//!
//! `runner/block_pipeline` reads the files of each stage and calls pure functions of `block`. Read them in this order:
//!
//! - `face`: `block/orientation.rs` (the direction of the face), `height_map.rs` (heights of both sides), `face_layer.rs`
//!   (the face without holder and walls)
//! - `align`: `relief.rs` and `page_ink.rs` (soft strokes of face and page), `align.rs` (all steps), `coarse.rs` (first
//!   positions by FFT), `windows.rs` (local shifts), `field.rs` (a smooth field of shifts), `page_map.rs` (the map of the
//!   face to the page), `agreement.rs` (whether the page belongs to the block)
//! - `boxes`: `labels/read.rs` and `block/label_fit.rs`, or `block/found_boxes/mod.rs`; then `characters.rs` (the place of
//!   each character, and how sure it is)
//! - `cut`: `cut.rs` (meshes and prints), `character_map.rs` (the maps of a character)
//!
//! `register` gets the pose that the block expects of a cut pair (`domain/alignment_prior.rs`).
//!
//! ## Two databases
//!
//! The catalog is a file of SQLite, or in PostgreSQL so that several computers can share it. `db/conn.rs` holds a connection
//! to either, `db/query.rs` and `db/script.rs` run statements, and `db/value.rs` and `db/row.rs` read values, the same for
//! both. Most statements have one text: `db/dialect.rs` translates it, and `migrations/postgres` creates the functions of
//! SQLite that it uses. All writes except group commits hold one lock, so they run one after another in both databases.
//! Every test of the catalog runs on both.
//!
//! Claims, and checkpoints of pairs, have statements for each database. In SQLite, a group commit is one transaction
//! (`queue/commit/group_commit.rs`). In PostgreSQL, each claim, and the checkpoints of a batch, are one statement that
//! commits by itself (`queue/commit/server_commit.rs`, `queue/server_claim.rs`, `queue/server_checkpoint.rs`). Its rows are
//! one array per column (`db/column_arrays.rs`), and settings of the write connection keep the planner to indexes (`db/postgres.rs`).
//!
//! In PostgreSQL, claims begin behind the last claimed pair (`queue/claim_start.rs`), because they would otherwise pass over
//! all pairs claimed before while another session holds a snapshot. So they do not always lease the most advanced pairs
//! first that other processes released. For the same reason, each process counts jobs in a new row every ten seconds
//! (`queue/counters.rs`).
//!
//! In PostgreSQL, `db init --roles` gives the tables to group roles (`db/roles.rs`, `migrations/roles/postgres.sql`): the
//! database refuses what a role may not do, such as a verdict under another name. `records/review_rights.rs` asks for these
//! rights first, so that `review` and `verdict` can say what is missing.
//!
//! If the server is unavailable, the writer task reconnects and repeats its commit (`queue/commit/write_connection.rs`); if
//! the server refuses the connection for good, the run ends. If an earlier attempt was stored but its reply was lost, the
//! fencing token and the position of the job show it; leases whose claim had no reply are searched for too
//! (`queue/commit/known_leases.rs`). The write connection of each worker holds a lock (`queue/worker_lock.rs`): a worker
//! whose lock is free for about 7 seconds and that sends no heartbeat is dead, except after an outage (`runner/liveness.rs`).
//! The transaction that recovers its pairs looks again first (`queue/recovery.rs`). `Catalog::retry_while_unavailable`
//! repeats the reads and other writes of a run. `runner/run_guard.rs` refuses runs with other settings.
//!
//! ## Files in an object store
//!
//! `store/input_place.rs` decides where an input is: at a path, below a named root, or in an object store. All readers take
//! the resulting `Input`. `store/remote/` has the rest: `client.rs`, `request.rs` and `bucket.rs` send requests,
//! `cache.rs` keeps local copies of inputs, `listing.rs` lists folders to notice changes, and `pack.rs` puts the
//! artifacts of a pair, or of a stage of a block, into one object. Meshes and prints of cut characters are inputs of
//! pairs, so they are objects of their own (`store/artifact_object.rs`). `runner/stage_files.rs` collects the stages
//! of a pair for a pack, `runner/prefetch.rs` reads the inputs of leased pairs before they start, and
//! `store/collect.rs` removes packs without a row. The row of a stage names pack and offset of each artifact, but the
//! hash of a result does not include them.
//!
//! ## A lost lease
//!
//! A living worker loses a lease if its heartbeats stop for longer than a lease lasts, or, in PostgreSQL, if it is without
//! a connection and a heartbeat for seven seconds (`crates/runner/src/liveness.rs`); or if another process of the same run
//! recovers the job because the worker's last heartbeat is more than a minute past the stage's deadline
//! (`crates/runner/src/worker_session.rs`; the times are in `Timing` in `crates/runner/src/policy.rs`). The start of a run
//! (`crates/runner/src/run.rs`) recovers the jobs of all other workers if it holds the lock `run.members` alone, because these
//! workers are then dead. A repair (`src/cli/check.rs`, `crates/runner/src/check/mod.rs`) must hold the same lock. It resets only the
//! jobs of damaged pairs, which ends their leases. After a refused heartbeat, a process recovers the jobs of its own
//! old id (`register_again`). The statements are in `crates/catalog/src/queue/recovery.rs` and `crates/catalog/src/audit/repair.rs`.
//! Each of them increases the job's fencing token.
//!
//! All writes under a lease are fenced; a release checks only worker and token. The statements in
//! `crates/catalog/src/queue/checkpoint.rs`, `server_checkpoint.rs` and `fail.rs`, for pairs and blocks, change a job only
//! if the worker and the token equal those of the lease, the worker has not ended, and its last heartbeat is at most one lease old by its own clock.
//! If a statement returns no row for a job, nothing of that job's request is stored, and the worker learns it from the
//! reply of `crates/catalog/src/queue/api.rs`:
//!
//! | refused write | reply | noticed in | what happens |
//! |---|---|---|---|
//! | checkpoint | `CheckpointOutcome::LeaseLost` | `checkpointer.rs`, `store_stages` | this and all later results are dropped. After the last stage, `Checkpointer::finish` notices (a task in `storing` of `scheduler.rs`). Before that, `pair_task.rs` notices as soon as a stage finishes after the refusal (`store` returns `false`), a stage fails or times out (`fail`), or the run stops. the stage that `compute_thread.rs` has begun by then is cancelled, and its memory is free before the slot is |
//! | failure | `false` | `pair_task.rs`, `store_failure` | the failure is not stored; after a refused checkpoint it is not even sent |
//! | heartbeat | `false` | `worker_session.rs`, `heartbeat`, for `scheduler.rs` | the process warns, releases the pairs that it has not started, ends its old id, registers as a new worker, and recovers the jobs of the old id; its running pairs end at their next write |
//! | claim | no leases | not distinguished from "no pair is ready" | tried again at every poll, until the next heartbeat |
//! | release | `false`, ignored | `release_all` in `prefetch.rs`, `StoredStages::finish` in `checkpointer.rs` | nothing: the job was recovered meanwhile; a pair that had started counts as released, or as done after `run --stage` |
//!
//! The pair ends as `PairEnd::LeaseLost`. `StoredStages::finish` in `checkpointer.rs` decides this after any refused
//! checkpoint, `store_failure` after a refused failure. `count` in `scheduler.rs` counts it as neither done nor failed,
//! and claims again. Stages stored before stay. The pair is leased again when its job is ready, unless the recovery
//! quarantined it. Artifact files without a row are used again if a stage gives the same bytes.
//!
//! If another worker recovered the job, the pair runs alone: other processes lease nothing until its next stage is
//! stored, and its own process until the pair leaves its slot. Its crash count grows if it was the only lease of its
//! worker or if the lease was overdue. A suspended worker counts as dead here. A job
//! that a process recovers itself (`register_again`), or that an ended worker left, is neither blamed nor alone. A
//! repair resets both.
//!
//! If heartbeats fail with an error for as long as a lease lasts, the run finishes the stages in progress and ends with
//! that error. If the write-ahead log is lost, it does so after the first failed heartbeat. An error while the files, a
//! checkpoint, a failure or the release of a running pair are stored has the same effect (`count`); the pair does not
//! fail, and its lease stays until it is recovered. An error of any other catalog call of the main loop ends the run
//! immediately, such as of a claim, of the release of pairs that have not started, of the search for ready pairs, of a
//! recovery, or of registering again.
//!
//! ## Cancellation
//!
//! A stage that takes too long, is stopped or has lost its lease is cancelled: inner loops poll the token of their thread
//! (`domain/cancel.rs`) and unwind to the function that started the computation. `runner/compute_thread.rs` and
//! `runner/block_task.rs` then wait for the end of the thread before its memory is given to others, and
//! `local_server/request_work.rs` cancels the work of requests that nobody waits for. Code that hands work to other
//! threads, such as those of `rayon`, takes the token along as a `ThreadToken`. A loop over vertices, triangles, pixels or
//! rows of a file must poll, at best through `polled`.
//!
//! ## Why `fit` reads the print
//!
//! `fit` decides which side of the mesh is carved. On 740 generated pairs, the mesh alone decided this for 13 % of the
//! pairs by the relief, and for at most 2 % of the pairs of a tier by its other evidence without errors. It was wrong
//! for 97 pairs. For the other 85 %, `fit` and `depth` would process both sides, with 25 % more CPU time (58.8 against
//! 47.0 ms). [`stages::pipeline`] shows both methods side by side.
//!
//! ## A new threshold metric
//!
//! Outside unit tests and comments, these files in `src/` name a variant of [`domain::ThresholdMetric`]; all others
//! iterate over its `ALL` or `PAPER`, or take a metric as an argument:
//!
//! - `src/cli/show.rs`: the metric that is compared with manual alignments; no change needed
//! - `crates/core/src/domain/metric.rs`: the variant with its definition, name and title; tables use this order
//! - `crates/report/src/comparison.rs`: which metrics are compared with each other
//! - `crates/align/src/stages/paper_method/normalize.rs`: chooses the paper's thresholds; no change needed
//! - `crates/align/src/stages/paper_method/register.rs`: picks the paper's ensemble; no change needed
//! - `crates/align/src/stages/register/metric_thresholds.rs`: chooses the thresholds, in the order of `ALL`
//!
//! Also touched: the weights in `crates/align/src/stages/register/confidence.rs`, `REVISION` in `crates/align/src/stages/register/mod.rs`, the
//! help text of `--metric` in `src/cli/contact_sheet.rs` and `src/cli/verdict.rs`, the `CHECK` lists of three tables and `user_version` in
//! `migrations/`, `SCHEMA_VERSION` in `crates/catalog/src/db/open.rs`, `README.md`, `docs/reference/report.md`, and tests and snapshots.
//! `CONTRIBUTING.md` lists them in the order of work.
//!
//! ## An export
//!
//! `crates/export/src/exporter.rs` reads pages of pairs, encodes them on all cores, and appends them in the order of the catalog.
//! `record.rs` defines the record of a pair that all formats share, `record_fields.rs` its fields with unit and frame,
//! `pair_pictures.rs` reads inputs and artifacts when a format needs them, and `format_writer.rs` says what a format must
//! implement; the formats are in `formats/`. `block_lines.rs` and `block_grid.rs` write whole blocks with the maps of their
//! faces, `page_labels.rs` their pages with the boxes of the characters. `manifest.rs` recognizes earlier exports, which are replaced as a whole.
//!
//! ## The 3D view
//!
//! `crates/export/src/scan_view/scan_data.rs` encodes a scan in the frame of its print with textures, which `view_inputs.rs` beside
//! it reads; `crates/core/src/mesh/clustering.rs` simplifies large scans. `assets/scan-viewer/scan-viewer.js` shows the data in three
//! places: on the page of `crates/pages/src/view/server.rs`, in a dialog of the review page, and in pages without a server
//! (`standalone_page.rs`).
//!
//! ## Seeing a block
//!
//! `crates/export/src/block_view` reads the stored results of a block again: `page_view.rs` the files, `page_layers.rs` draws any
//! part of the page, of the relief in the frame of the page, or of both over each other, and `block_sheets.rs` the two
//! pictures of `contact-sheet --block`. The page of `view BLOCK` (`crates/pages/src/view/block_server.rs`, `assets/block-view`) asks for
//! the same layers, and for the 3D view of a character's pair. `view::correction_server` lets a person choose the same
//! places on the relief and on the page; the catalog stores them as control points, and `align` starts from them.
//!
//! ## Modules
//!
//! `tests/it/layers.rs` checks that a top-level module imports only the modules in its line, that
//! source files do not import each other in cycles, that the files in the two lists above exist, that the first list
//! stays short, and that every file that names a metric is listed.
//!
//! | module | purpose | may import |
//! |---|---|---|
//! | `domain` | ids, stages, job states, transforms, outcomes, verdicts | |
//! | `simd` | runtime dispatch to the widest vector instructions of the processor | |
//! | `raster` | grids, masks, depth maps, print images, warps; decoders of PNG, JPEG, TIFF | `domain`, `simd` |
//! | `platform` | operations that differ between operating systems: identity of files, syncing, signals | |
//! | `page_vec` | vectors on huge pages with a cache of freed pages | `domain` |
//! | `mesh` | triangle meshes and point sets; readers of OBJ, PLY, STL, XYZ | `domain`, `page_vec` |
//! | `manifest` | lists of pairs: CSV, JSON Lines, two directories; lists of blocks | `domain` |
//! | `labels` | boxes of characters on a page: readers of eight formats, writers of VIA and COCO, names in reading order | `domain` |
//! | `stages` | fit, depth, normalize and register as pure functions; scores and confidence | `domain`, `simd`, `page_vec`, `mesh`, `raster` |
//! | `block` | a whole block and the image of its page: height maps, registration, characters, cut | `domain`, `simd`, `mesh`, `raster` |
//! | `local_server` | a web server for the browser of one user: guard, session, connection limits, frame of pages | `domain`, `platform` |
//! | `failpoint` | named points at which a test can kill the process | `domain` |
//! | `store` | a project on disk: input files and artifacts by content hash | `domain`, `page_vec`, `mesh`, `raster`, `failpoint`, `platform` |
//! | `catalog` | SQLite or PostgreSQL: pairs, jobs, leases, results, verdicts; all SQL | `domain`, `failpoint`, `platform` |
//! | `runner` | workers, scheduling, retry policy, execution of a pair, events | `domain`, `page_vec`, `mesh`, `raster`, `block`, `labels`, `stages`, `store`, `catalog`, `failpoint`, `platform` |
//! | `check` | consistency check and repair of a project | `domain`, `store`, `catalog`, `runner` |
//! | `report` | statistics of the results as plain data, and renderers for text, CSV, JSON, Markdown, LaTeX and HTML | `domain`, `raster`, `store`, `catalog` |
//! | `export` | aligned pairs for other tools, overlays, contact sheets, pictures of blocks and of reports | `domain`, `mesh`, `raster`, `labels`, `block`, `store`, `catalog`, `report` |
//! | `review` | the review page: verdicts, manual alignments, attention checks | `domain`, `raster`, `stages`, `local_server`, `store`, `catalog`, `report`, `export` |
//! | `view` | the pages that show one scan on its print in 3D, or a whole block | `domain`, `local_server`, `export` |
//! | `demo` | the generated dataset with ground truth | `domain`, `mesh`, `raster` |
//! | `config` | layered settings with types, ranges and origins | `domain`, `mesh`, `raster`, `stages`, `store`, `runner`, `platform` |
//! | `documentation` | the files of `docs/` as web pages | |
//! | `cli` | one file per command; exit codes, progress, logging | all |
//!
//! Benches: `benches/accuracy` runs the stages on pairs of [`demo`] and compares them with ground truth;
//! `benches/speed` times readers and stages by scan size; `benches/queue` times the catalog on many pairs;
//! `benches/peers` runs other tools on the same files; `benches/peers-queue` runs another job queue under the same load
//! (see `benches/queue/main.rs`), and `benches/queue/peers` has scripts for two queues on PostgreSQL.

pub mod cli;
pub mod config;
pub mod documentation;
pub use mocban_align::{block, stages};
pub use mocban_catalog as catalog;
pub use mocban_core::{domain, mesh, page_vec, raster, simd};
pub use mocban_demo as demo;
pub use mocban_export as export;
pub use mocban_lists::{labels, manifest};
pub use mocban_pages::{local_server, review, view};
pub use mocban_report as report;
pub use mocban_runner::{self as runner, check};
pub use mocban_store as store;
